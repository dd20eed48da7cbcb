// What some columns of a pass take up of its residual, or of a combination of other columns.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/discovery/column_pass.hpp"

namespace selfcal::discovery {

// Square that columns of information G and score b take up.
double gain_of(const Eigen::MatrixXd& G, const Eigen::VectorXd& b);
// The same of the residual of `sums`, by these columns.
double gain_of(const ColumnSums& sums, const std::vector<int>& columns);

// Share of the square of `signature` (a combination of the first columns) that `columns` cannot make.
double share_beside(const ColumnSums& sums, const Eigen::VectorXd& signature, const std::vector<int>& columns);

}  // namespace selfcal::discovery
