#include "estimator/passes/dynamic_transition.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/filter/state_layout.hpp"

namespace selfcal {

bool BiasNoise::drawn_in(const Interval& interval) const {
  const auto next = std::upper_bound(drawn_anew_s.begin(), drawn_anew_s.end(), interval.start_s);
  return next != drawn_anew_s.end() && *next <= interval.end_s;
}

double BiasNoise::kept(const Interval& interval) const {
  return drawn_in(interval) ? 0.0 : std::exp(-interval.length_s / correlation_s);
}

double BiasNoise::drive_variance(const Interval& interval) const {
  const double forgotten = drawn_in(interval) ? 1.0 : -std::expm1(-2.0 * interval.length_s / correlation_s);
  return rate * rate * interval.length_s + sigma * sigma * forgotten;
}

DynamicTransition::DynamicTransition(const ObservationModel& observation, std::vector<BiasNoise> biases,
                                     double interval_s)
    : biases_(std::move(biases)) {
  const int motion = observation.state_count(), at = StateLayout::navigation_count;
  const int n = at + motion + static_cast<int>(biases_.size());
  Phi_ = Eigen::MatrixXd::Zero(n, n);
  Phi_.block(at, at, motion, motion) = observation.transition(interval_s);
}

const Eigen::MatrixXd& DynamicTransition::over(const Interval& interval) {
  Phi_.topLeftCorner<StateLayout::navigation_count, StateLayout::navigation_count>() = interval.Phi;
  for (int k = 0; k < static_cast<int>(biases_.size()); ++k) {
    const BiasNoise& bias = biases_[static_cast<std::size_t>(k)];
    const int at = first_bias() + k;
    Phi_(at, at) = bias.kept(interval);
    Phi_.col(at).head<StateLayout::navigation_count>() =
        0.5 * (1.0 + Phi_(at, at)) * interval.Gamma.col(bias.parameter);
  }
  return Phi_;
}

Eigen::MatrixXd DynamicTransition::drive(const Interval& interval) const {
  const auto n = static_cast<Eigen::Index>(biases_.size());
  Eigen::MatrixXd drive = Eigen::MatrixXd::Zero(count(), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    drive.col(k).head<StateLayout::navigation_count>() =
        0.5 * interval.Gamma.col(biases_[static_cast<std::size_t>(k)].parameter);
    drive(first_bias() + k, k) = 1.0;
  }
  return drive;
}

}  // namespace selfcal
