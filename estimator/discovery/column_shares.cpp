#include "estimator/discovery/column_shares.hpp"

#include <Eigen/Cholesky>

namespace selfcal::discovery {

double gain_of(const ColumnSums& sums, const std::vector<int>& columns) {
  const Eigen::MatrixXd G = sums.information(columns, columns);
  const Eigen::VectorXd b = sums.score(columns);
  const Eigen::VectorXd scale = G.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * G * scale.asDiagonal();
  scaled.diagonal().array() += 1e-9;
  const Eigen::VectorXd part = scale.cwiseProduct(b);
  return part.dot(scaled.ldlt().solve(part));
}

double share_beside(const ColumnSums& sums, const Eigen::VectorXd& signature, const std::vector<int>& columns) {
  const auto n = signature.size();
  const double square = signature.dot(sums.information.topLeftCorner(n, n) * signature);
  ColumnSums as_data;
  as_data.information = sums.information;
  as_data.score = sums.information.leftCols(n) * signature;
  return 1.0 - gain_of(as_data, columns) / square;
}

}  // namespace selfcal::discovery
