#include "estimator/discovery/shared_parameters.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

constexpr int biases = 6;  // the first of the 24: accelerometer biases, gyro drifts
constexpr double least_told_sigma = 4.0;

struct Stack {
  Eigen::VectorXd x;  // [24 R + coefficients and constants]
  Eigen::MatrixXd covariance;
};

Stack stack(const LawFit& fit) {
  const auto count = static_cast<Eigen::Index>(fit.recordings.size());
  const Eigen::Index laws = fit.covariance.rows(), n = sensor_parameter_count * count + laws;
  Stack s{Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  Eigen::MatrixXd all_shifts = Eigen::MatrixXd::Zero(n, laws);
  for (Eigen::Index r = 0; r < count; ++r) {
    const FittedRecording& one = fit.recordings[static_cast<std::size_t>(r)];
    const Eigen::Index at = sensor_parameter_count * r;
    s.x.segment<sensor_parameter_count>(at) = one.parameters;
    s.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at) = one.covariance_alone;
    all_shifts.middleRows(at, sensor_parameter_count) = one.shift;
  }
  s.x.segment(sensor_parameter_count * count, fit.coefficient.size()) = fit.coefficient;
  all_shifts.bottomRows(laws).setIdentity();
  s.covariance += all_shifts * fit.covariance * all_shifts.transpose();
  return s;
}

// Rows of "recording r less the first" for parameters [from, to) of the 24.
Eigen::MatrixXd differences(std::size_t recordings, int from, int to, Eigen::Index size) {
  const auto rows = static_cast<Eigen::Index>(recordings - 1) * (to - from);
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(rows, size);
  Eigen::Index row = 0;
  for (std::size_t r = 1; r < recordings; ++r) {
    for (int p = from; p < to; ++p, ++row) {
      D(row, p) = -1.0;
      D(row, static_cast<Eigen::Index>(r) * sensor_parameter_count + p) = 1.0;
    }
  }
  return D;
}

double log_p_of_zero(const Stack& s, const Eigen::MatrixXd& D) {
  const Eigen::VectorXd d = D * s.x;
  const Eigen::LDLT<Eigen::MatrixXd> solver(D * s.covariance * D.transpose());
  return std::min(0.0, log_chi_squared_tail(d.dot(solver.solve(d)), static_cast<double>(D.rows())));
}

void impose(const Eigen::MatrixXd& D, Stack& s) {
  const Eigen::MatrixXd image = s.covariance * D.transpose();
  const Eigen::LDLT<Eigen::MatrixXd> solver(D * image);
  s.x -= image * solver.solve(D * s.x);
  s.covariance -= image * solver.solve(image.transpose());
}

void add_differing(const Stack& s, const Eigen::MatrixXd& D, int from, int to, SharedParameters& result) {
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

SharedParameters share_parameters(const LawFit& fit, double rate) {
  SharedParameters result;
  Stack s = stack(fit);
  const std::size_t count = fit.recordings.size();
  const auto decide = [&](int from, int to, double& log_p) {
    const Eigen::MatrixXd D = differences(count, from, to, s.x.size());
    log_p = log_p_of_zero(s, D);
    const bool shared = log_p > std::log(rate);
    shared ? impose(D, s) : add_differing(s, D, from, to, result);
    return shared;
  };
  if (count > 1) {
    result.lasting_shared = decide(biases, sensor_parameter_count, result.log_p_lasting);
    result.biases_shared = decide(0, biases, result.log_p_biases);
  }
  std::sort(result.differing.begin(), result.differing.end(), [](const auto& a, const auto& b) {
    return std::abs(a.difference / a.sigma) > std::abs(b.difference / b.sigma);
  });
  for (std::size_t r = 0; r < count; ++r) {
    const Eigen::Index at = sensor_parameter_count * static_cast<Eigen::Index>(r);
    result.parameters.emplace_back(s.x.segment<sensor_parameter_count>(at));
    result.covariance.emplace_back(s.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at));
  }
  const Eigen::Index laws = fit.covariance.rows();
  result.coefficient = s.x.segment(s.x.size() - laws, fit.coefficient.size());
  result.coefficient_covariance = s.covariance.bottomRightCorner(laws, laws);
  return result;
}

}  // namespace selfcal::discovery
