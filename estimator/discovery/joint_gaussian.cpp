#include "estimator/discovery/joint_gaussian.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {

JointGaussian JointGaussian::of(std::span<const FittedRecording> recordings, const Eigen::VectorXd& value,
                                const Eigen::MatrixXd& value_covariance) {
  const auto count = static_cast<Eigen::Index>(recordings.size());
  const Eigen::Index values = value_covariance.rows(), n = sensor_parameter_count * count + values;
  JointGaussian s{Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  Eigen::MatrixXd all_shifts = Eigen::MatrixXd::Zero(n, values);
  for (Eigen::Index r = 0; r < count; ++r) {
    const FittedRecording& one = recordings[static_cast<std::size_t>(r)];
    const Eigen::Index at = sensor_parameter_count * r;
    s.x.segment<sensor_parameter_count>(at) = one.parameters;
    s.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at) = one.covariance_alone;
    all_shifts.middleRows(at, sensor_parameter_count) = one.shift;
  }
  s.x.segment(sensor_parameter_count * count, value.size()) = value;
  all_shifts.bottomRows(values).setIdentity();
  s.covariance += all_shifts * value_covariance * all_shifts.transpose();
  return s;
}

double JointGaussian::log_p_of_zero(const Eigen::MatrixXd& D) const {
  const Eigen::VectorXd d = D * x;
  const Eigen::LDLT<Eigen::MatrixXd> solver(D * covariance * D.transpose());
  return std::min(0.0, log_chi_squared_tail(d.dot(solver.solve(d)), static_cast<double>(D.rows())));
}

void JointGaussian::impose(const Eigen::MatrixXd& D) {
  const Eigen::MatrixXd image = covariance * D.transpose();
  const Eigen::LDLT<Eigen::MatrixXd> solver(D * image);
  x -= image * solver.solve(D * x);
  covariance -= image * solver.solve(image.transpose());
}

Eigen::MatrixXd differences(const std::vector<Eigen::Index>& places, Eigen::Index from, Eigen::Index to,
                            Eigen::Index size) {
  const auto others = static_cast<Eigen::Index>(places.size()) - 1;
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(others * (to - from), size);
  Eigen::Index row = 0;
  for (std::size_t k = 1; k < places.size(); ++k) {
    for (Eigen::Index p = from; p < to; ++p, ++row) {
      D(row, places.front() + p) = -1.0;
      D(row, places[k] + p) = 1.0;
    }
  }
  return D;
}

}  // namespace selfcal::discovery
