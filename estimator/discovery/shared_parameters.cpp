#include "estimator/discovery/shared_parameters.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::discovery {
namespace {

constexpr int biases = 6;  // the first of the 24: accelerometer biases, gyro drifts
constexpr double least_told_sigma = 4.0;

void add_differing(const JointGaussian& s, const Eigen::MatrixXd& D, int from, int to, SharedParameters& result) {
  const Eigen::VectorXd d = D * s.x;
  const Eigen::MatrixXd C = D * s.covariance * D.transpose();
  for (Eigen::Index row = 0; row < d.size(); ++row) {
    const double sigma = std::sqrt(C(row, row));
    if (std::abs(d(row)) > least_told_sigma * sigma) {
      result.differing.push_back({from + static_cast<int>(row) % (to - from),
                                  1 + static_cast<std::size_t>(row) / static_cast<std::size_t>(to - from), d(row),
                                  sigma});
    }
  }
}

}  // namespace

SharedParameters share(JointGaussian& s, std::size_t recordings, double rate) {
  SharedParameters result;
  std::vector<Eigen::Index> places;
  for (std::size_t r = 0; r < recordings; ++r) {
    places.push_back(sensor_parameter_count * static_cast<Eigen::Index>(r));
  }
  const auto decide = [&](int from, int to, double& log_p) {
    const Eigen::MatrixXd D = differences(places, from, to, s.x.size());
    log_p = s.log_p_of_zero(D);
    const bool shared = log_p > std::log(rate);
    shared ? s.impose(D) : add_differing(s, D, from, to, result);
    return shared;
  };
  if (recordings > 1) {
    result.lasting_shared = decide(biases, sensor_parameter_count, result.log_p_lasting);
    result.biases_shared = decide(0, biases, result.log_p_biases);
  }
  std::sort(result.differing.begin(), result.differing.end(), [](const auto& a, const auto& b) {
    return std::abs(a.difference / a.sigma) > std::abs(b.difference / b.sigma);
  });
  return result;
}

void read_parameters(const JointGaussian& s, std::size_t recordings, SharedParameters& result) {
  for (std::size_t r = 0; r < recordings; ++r) {
    const Eigen::Index at = sensor_parameter_count * static_cast<Eigen::Index>(r);
    result.parameters.emplace_back(s.x.segment<sensor_parameter_count>(at));
    result.covariance.emplace_back(s.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at));
  }
}

SharedParameters share_parameters(const LawFit& fit, double rate) {
  const std::size_t count = fit.recordings.size();
  JointGaussian s = JointGaussian::of(fit.recordings, fit.coefficient, fit.covariance);
  SharedParameters result = share(s, count, rate);
  read_parameters(s, count, result);
  const Eigen::Index laws = fit.covariance.rows();
  result.coefficient = s.x.segment(s.x.size() - laws, fit.coefficient.size());
  result.coefficient_covariance = s.covariance.bottomRightCorner(laws, laws);
  return result;
}

}  // namespace selfcal::discovery
