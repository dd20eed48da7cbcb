#include "estimator/discovery/column_shares.hpp"

#include <Eigen/Cholesky>

namespace selfcal::discovery {

double gain_of(const Eigen::MatrixXd& G, const Eigen::VectorXd& b) {
  const Eigen::VectorXd scale = G.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * G * scale.asDiagonal();
  scaled.diagonal().array() += 1e-9;
  const Eigen::VectorXd part = scale.cwiseProduct(b);
  return part.dot(scaled.ldlt().solve(part));
}

double gain_of(const ColumnSums& sums, const std::vector<int>& columns) {
  return gain_of(sums.information(columns, columns), sums.score(columns));
}

double share_beside(const ColumnSums& sums, const Eigen::VectorXd& signature, const std::vector<int>& columns) {
  const auto n = signature.size();
  const double square = signature.dot(sums.information.topLeftCorner(n, n) * signature);
  return 1.0 -
         gain_of(sums.information(columns, columns), sums.information.leftCols(n)(columns, Eigen::all) * signature) /
             square;
}

}  // namespace selfcal::discovery
