#include "estimator/diagnosis/noise/velocity_noise.hpp"

#include <cmath>
#include <functional>
#include <vector>

namespace selfcal::diagnosis {
namespace {

constexpr double colours = 0.1;          // share of an interval's position variance from which it is modelled
constexpr double least_log_gain = 10.0;  // of the likelihood, for three densities more

// Climbs from `best` along one density after the other, by ever smaller factors; `top` is the value there. Velocity and
// position trade against each other along a ridge: that takes many rounds.
template <std::size_t N>
void climb(NoiseDensities& best, double& top, const std::array<double, N>& steps,
           const std::function<double(const NoiseDensities&)>& log_likelihood) {
  constexpr int most_rounds = 20;
  for (const double step : steps) {
    double before = -HUGE_VAL;
    for (int round = 0; round < most_rounds && top > before; ++round) {
      before = top;
      for (double& value : best) {
        for (const double factor : {1.0 / step, step}) {
          const double start = value;
          for (double last = value;; last = value) {
            value *= factor;
            const double found = log_likelihood(best);
            if (found <= top) {
              value = last;
              break;
            }
            top = found;
          }
          if (value != start) {
            break;  // the top lies on this side
          }
        }
      }
    }
  }
}

}  // namespace

NoiseModel with_velocity_noise(NoiseModel noise, const NoiseDensities& d) {
  noise.gyro_arw = d[0];
  noise.accel_vrw = d[1];
  noise.observation.motion.fill(position_walk(d[2]));
  return noise;
}

bool fit_velocity_noise(PassInput& input, const NoiseCheck& noise) {
  constexpr int accelerometers = 3;
  double variance = 0.0;  // of the integral's white noise, mean of the axes
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
  const auto log_likelihood = [&](const NoiseDensities& d) {
    PassInput trial = input;
    trial.noise = with_velocity_noise(input.noise, d);
    return run_pass(trial).log_likelihood;
  };
  NoiseDensities best = {input.noise.gyro_arw, input.noise.accel_vrw, density};
  double top = log_likelihood(best);
  climb(best, top, std::array{2.0, 1.25, 1.06}, log_likelihood);
  if (top < before + least_log_gain) {
    return false;
  }
  input.noise = with_velocity_noise(input.noise, best);
  return true;
}

std::optional<NoiseModel> refit_velocity_noise(const NoiseModel& noise,
                                               const std::function<double(const NoiseModel&)>& log_likelihood) {
  const double density = walk_density(noise.observation.motion.front());
  if (density == 0.0) {
    return std::nullopt;
  }
  const NoiseDensities before = {noise.gyro_arw, noise.accel_vrw, density};
  const auto of_densities = [&](const NoiseDensities& d) { return log_likelihood(with_velocity_noise(noise, d)); };
  NoiseDensities best = before;
  double top = of_densities(best);
  climb(best, top, std::array{1.25, 1.06}, of_densities);
  if (best == before) {
    return std::nullopt;
  }
  return with_velocity_noise(noise, best);
}

}  // namespace selfcal::diagnosis
