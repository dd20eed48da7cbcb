#include "estimator/passes/motion_model.hpp"

#include <cmath>

namespace selfcal {
namespace {

constexpr double walk_correlation_s = 1e5;

}  // namespace

// Variance 2 sigma^2 T/decay per interval.
MotionModel position_walk(double density) {
  return {{{0.0, walk_correlation_s, density * std::sqrt(0.5 * walk_correlation_s)}}};
}

double walk_density(const MotionModel& motion) {
  const bool walk = motion.oscillations.size() == 1 && motion.oscillations.front().omega == 0.0 &&
                    motion.oscillations.front().decay_s == walk_correlation_s;
  return walk ? motion.oscillations.front().sigma / std::sqrt(0.5 * walk_correlation_s) : 0.0;
}

OscillationStep::OscillationStep(const Oscillation& oscillation, double interval_s) {
  const double damping = std::exp(-interval_s / oscillation.decay_s);
  cosine = damping * std::cos(oscillation.omega * interval_s);
  sine = damping * std::sin(oscillation.omega * interval_s);
  // 1 - damping^2 without cancellation: a swell may keep its phase for days.
  drive_variance = -std::expm1(-2.0 * interval_s / oscillation.decay_s) * oscillation.sigma * oscillation.sigma;
}

double MotionModel::unforeseen(double interval_s) const {
  double variance = 0.0;
  for (const Oscillation& oscillation : oscillations) {
    variance += OscillationStep(oscillation, interval_s).drive_variance;
  }
  return std::sqrt(variance);
}

int ObservationModel::state_count() const {
  int count = 0;
  for (const MotionModel& m : motion) {
    count += m.state_count();
  }
  return count;
}

Eigen::MatrixXd ObservationModel::transition(double interval_s) const {
  Eigen::MatrixXd Phi = Eigen::MatrixXd::Zero(state_count(), state_count());
  Eigen::Index at = 0;
  for (const MotionModel& m : motion) {
    for (const Oscillation& oscillation : m.oscillations) {
      const OscillationStep step(oscillation, interval_s);
      Phi.block<2, 2>(at, at) << step.cosine, -step.sine, step.sine, step.cosine;
      at += 2;
    }
  }
  return Phi;
}

}  // namespace selfcal
