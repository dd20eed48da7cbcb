#include "estimator/diagnosis/noise/velocity_noise.hpp"

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "estimator/statistics/climb.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double colours = 0.1;          // share of an interval's position variance from which it is modelled
constexpr double least_log_gain = 10.0;  // of the likelihood, for three densities more

// Velocity and position trade against each other along a ridge: that takes many moves and rounds.
Summit<3> top_of(const NoiseDensities& start, std::vector<double> factors,
                 const std::function<double(const NoiseDensities&)>& log_likelihood) {
  constexpr int many = 1000;
  return climb<3>(start, {.factors = std::move(factors), .most_rounds = 20, .most_moves = many}, log_likelihood);
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
  const Summit<3> top =
      top_of({input.noise.gyro_arw, input.noise.accel_vrw, density}, {2.0, 1.25, 1.06}, log_likelihood);
  if (top.log_likelihood < before + least_log_gain) {
    return false;
  }
  input.noise = with_velocity_noise(input.noise, top.at);
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
  const NoiseDensities best = top_of(before, {1.25, 1.06}, of_densities).at;
  if (best == before) {
    return std::nullopt;
  }
  return with_velocity_noise(noise, best);
}

}  // namespace selfcal::diagnosis
