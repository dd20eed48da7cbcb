#include "estimator/diagnosis/poses/pose_accel_jump.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/poses/pose_regression.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {

std::optional<AccelJump> find_accel_jump(const std::vector<Pose>& poses, double log_limit, double log_p_of_effect,
                                         AccelModel& model) {
  const Eigen::Index n = model.residual.size();
  constexpr Eigen::Index side = 3, unknown = 12, spare = 2;
  if (n < unknown + spare) {
    return {};
  }
  const std::vector<double> time_s = middles(poses);
  Eigen::Index best = 0;
  RowComparison of_best;
  std::vector<double> square(static_cast<std::size_t>(n), HUGE_VAL);  // what a step before each pose leaves
  for (Eigen::Index first = side; first + side <= n; ++first) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(n, 3);
    columns.bottomRows(n - first) = -model.jacobian.bottomLeftCorner(n - first, 3);  // of a reading's bias, raw
    RowComparison c = compare(model.jacobian, columns, model.residual, time_s, true);
    square[static_cast<std::size_t>(first)] = c.with.square;
    if (c.log_p < of_best.log_p) {
      of_best = std::move(c);
      best = first;
    }
  }
  const double log_p = log_corrected(of_best.log_p, static_cast<double>(n - 2 * side + 1));
  const double may_be = std::log(0.1);
  constexpr double odds = 4.605;  // ln 100
  if (best == 0 || log_p > may_be) {
    return {};
  }
  const Eigen::Matrix<double, 9, 1> moved = of_best.with.value.head<9>(), beside = of_best.with.sigma.head<9>();
  model.sigma = model.sigma.cwiseMax((moved.cwiseAbs2() + beside.cwiseAbs2()).cwiseSqrt()).cwiseMin(model.before);
  model.open = model.held.select(model.open, model.sigma);
  if (log_p > log_limit || log_p + odds > log_p_of_effect) {
    return {};
  }
  // Of unknown noise the likelihood of a step is its square to the power of minus half the degrees of freedom.
  const double as_likely = of_best.with.square * std::exp(2.0 * odds / static_cast<double>(n - of_best.with.rank));
  const auto may_be_there = [as_likely](double s) { return s <= as_likely; };
  const auto first = std::find_if(square.begin(), square.end(), may_be_there) - square.begin();
  const auto last = n - 1 - (std::find_if(square.rbegin(), square.rend(), may_be_there) - square.rbegin());
  const Pose &before = poses[static_cast<std::size_t>(first - 1)], &behind = poses[static_cast<std::size_t>(last)];
  AccelJump jump;
  jump.from_pose = static_cast<int>(first);
  jump.to_pose = static_cast<int>(last + 1);
  jump.from_s = before.middle_s - 0.5 * before.length_s;  // within either it moves that mean in part
  jump.to_s = behind.middle_s + 0.5 * behind.length_s;
  jump.size_g = of_best.with.value.segment<3>(9) / model.raw_per_g;
  jump.sigma_g = of_best.with.sigma.segment<3>(9) / model.raw_per_g;
  return jump;
}

}  // namespace selfcal::diagnosis
