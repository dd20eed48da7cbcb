#include "estimator/diagnosis/poses/pose_drift.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/poses/pose_regression.hpp"

namespace selfcal::diagnosis {
namespace {

using Nine = Eigen::Matrix<double, 9, 1>;

// By how much the nine move where the readings of the poses are `too_much`, raw, of one axis.
Nine moved_by(const Eigen::VectorXd& too_much, int axis, const AccelModel& m) {
  constexpr double least = 1e-7;  // of g, as the fit has it
  const double noise = std::max(least, m.noise_of_means);
  const Eigen::MatrixXd J = m.jacobian * m.before.asDiagonal() / noise;
  const Eigen::VectorXd residual = -m.jacobian.col(axis).cwiseProduct(too_much);  // of a reading's bias
  const Eigen::Matrix<double, 9, 9> normal = J.transpose() * J + Eigen::Matrix<double, 9, 9>::Identity();
  const Nine step = normal.llt().solve(-J.transpose() * residual / noise);
  return step.cwiseProduct(m.before);
}

}  // namespace

void hold_drift(const std::vector<Pose>& poses, AccelModel& m) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  constexpr Eigen::Index unknown = 2, fewest = 6;
  // Means of a table have no halves.
  const auto is_mean = [](const Pose& p) { return p.accel_white.isZero() || p.length_s <= 0.0; };
  if (n < fewest || std::any_of(poses.begin(), poses.end(), is_mean)) {
    return;
  }
  const std::vector<double> time_s = middles(poses);
  const double begin = time_s.front(), span = time_s.back() - begin;
  Eigen::MatrixXd halves(n, unknown), drifts(n, unknown);  // what each coefficient makes of half a pose, and of a pose
  for (Eigen::Index k = 0; k < n; ++k) {
    const double at = (time_s[static_cast<std::size_t>(k)] - begin) / span;
    // Means of the halves lie half a pose apart; half of that.
    const double quarter = 0.25 * poses[static_cast<std::size_t>(k)].length_s / span;
    halves.row(k) << quarter, 2.0 * quarter * (at - 0.5);
    drifts.row(k) << at, at * at - at;
  }
  drifts.rowwise() -= drifts.colwise().mean();
  Nine square = m.sigma.cwiseAbs2();
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd half(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      half(k) = poses[static_cast<std::size_t>(k)].accel_half(axis);
    }
    Regression without;
    without.square = half.squaredNorm();
    const Regression with = regress(halves, half);
    const double may_be = std::log(0.1 / 3.0);
    if (!(without.square > 0.0) || log_p_of(without, with, n) > may_be) {
      continue;
    }
    const Eigen::VectorXd drift = drifts * with.value;
    square += moved_by(drift, axis, m).cwiseAbs2();
    for (Eigen::Index j = 0; j < unknown; ++j) {
      square += moved_by(drifts.col(j) * with.sigma(j), axis, m).cwiseAbs2();
    }
    square(axis) += drift.squaredNorm() / static_cast<double>(n);
  }
  m.sigma = square.cwiseSqrt().cwiseMin(m.before);
}

}  // namespace selfcal::diagnosis
