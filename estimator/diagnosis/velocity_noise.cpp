#include "estimator/diagnosis/velocity_noise.hpp"

#include <array>
#include <cmath>

namespace selfcal::diagnosis {
namespace {

constexpr double colours = 0.1;         // share of an interval's position variance from which it is modelled
constexpr double least_log_gain = 10.0; // of the likelihood, for three densities more
constexpr double correlation_s = 1e5;   // of the walk: far beyond any recording

// Walk of `density` (m/sqrt(s)) as an oscillation that never turns: variance 2 sigma^2 T/decay per interval.
MotionModel walk(double density) { return {{{0.0, correlation_s, density * std::sqrt(0.5 * correlation_s)}}}; }

// The densities of angle and force, and of the walk.
PassInput with(const PassInput& input, const std::array<double, 3>& d) {
  PassInput changed = input;
  changed.noise.gyro_arw = d[0];
  changed.noise.accel_vrw = d[1];
  changed.noise.observation.motion.fill(walk(d[2]));
  return changed;
}

}  // namespace

bool fit_velocity_noise(PassInput& input, const NoiseCheck& noise) {
  constexpr int accelerometers = 3;
  double variance = 0.0;   // of the integral's white noise, mean of the axes
  for (std::size_t axis = accelerometers; axis < noise.axes.size(); ++axis) {
    variance += noise.axes[axis].increment_sigma * noise.axes[axis].increment_sigma / 3.0;
  }
  const double density = std::sqrt(variance / input.data->sample_rate_hz);
  const double T = input.interval_s;
  const double of_force = input.noise.accel_vrw * input.noise.accel_vrw * T * T * T / 3.0;
  if (input.noise.observation.state_count() > 0 || density * density * T < colours * of_force) {
    return false;
  }
  const double before = run_pass(input).log_likelihood;
  std::array<double, 3> best = {input.noise.gyro_arw, input.noise.accel_vrw, density};
  double top = run_pass(with(input, best)).log_likelihood;
  constexpr std::array<double, 2> steps = {2.0, 1.25};
  constexpr int rounds = 2;
  for (const double step : steps) {
    for (int round = 0; round < rounds; ++round) {
      for (double& value : best) {
        for (const double factor : {1.0 / step, step}) {
          const double start = value;
          for (double last = value;; last = value) {
            value *= factor;
            const double found = run_pass(with(input, best)).log_likelihood;
            if (found <= top) {
              value = last;
              break;
            }
            top = found;
          }
          if (value != start) {
            break;   // the top lies on this side
          }
        }
      }
    }
  }
  if (top < before + least_log_gain) {
    return false;
  }
  input = with(input, best);
  return true;
}

}  // namespace selfcal::diagnosis
