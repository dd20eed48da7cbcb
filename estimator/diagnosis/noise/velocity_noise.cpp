#include "estimator/diagnosis/noise/velocity_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "estimator/diagnosis/noise/loudness.hpp"
#include "estimator/diagnosis/regression/linear_model.hpp"
#include "estimator/statistics/climb.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double colours = 0.1;          // share of an interval's position variance from which it is modelled
constexpr double least_log_gain = 10.0;  // of the likelihood, for densities of nine axes in the place of two

// ARW, VRW and noise of the integral, of x, y and z each; how much larger the variance is in turns.
using Sizes = std::array<double, 10>;

double root_mean_square(const Vector3& v) { return std::sqrt(v.squaredNorm() / 3.0); }

Sizes sizes_of(const NoiseModel& noise) {
  const AxisDensities& a = *noise.axes;
  const double turns = noise.disturbed.empty() ? 1.0 : noise.disturbed.front().factor;
  return {a.gyro_arw(0),  a.gyro_arw(1),       a.gyro_arw(2),       a.accel_vrw(0),      a.accel_vrw(1),
          a.accel_vrw(2), a.accel_integral(0), a.accel_integral(1), a.accel_integral(2), turns};
}

NoiseModel with_sizes(NoiseModel noise, const Sizes& s) {
  noise.axes = {Vector3(s[0], s[1], s[2]), Vector3(s[3], s[4], s[5]), Vector3(s[6], s[7], s[8])};
  noise.gyro_arw = root_mean_square(noise.axes->gyro_arw);
  noise.accel_vrw = root_mean_square(noise.axes->accel_vrw);
  for (Disturbance& turn : noise.disturbed) {
    turn.factor = s[9];
  }
  return noise;
}

using LogLikelihood = std::function<double(const NoiseModel&)>;

// Densities trade against each other along ridges: that takes many moves and rounds. What does not matter any more is not followed to zero.
const Climb to_the_top = {
    .factors = {2.0, 1.25, 1.06}, .most_rounds = 20, .most_moves = 4, .enough = 0.1, .farthest = 30.0};

struct Fitted {
  NoiseModel noise;
  double log_likelihood = 0.0;
};

Fitted top_of(const NoiseModel& start, const LogLikelihood& log_likelihood) {
  const auto of = [&](const Sizes& s) { return log_likelihood(with_sizes(start, s)); };
  const Summit<10> top = climb<10>(sizes_of(start), to_the_top, of);
  return {with_sizes(start, top.at), top.log_likelihood};
}

// Where the base changes its loudness the accelerometers' noise follows it: variances as 1 + (power / knee)^slope.
NoiseModel shaken_by(const std::vector<Loudness>& loudness, NoiseModel noise, double knee, double slope) {
  noise.shaken.clear();
  for (const Loudness& l : loudness) {
    noise.shaken.push_back({l.start_s, l.end_s, 1.0 + std::pow(l.power / knee, slope)});
  }
  return noise;
}

Fitted top_beside(const std::vector<Loudness>& loudness, const NoiseModel& start, const LogLikelihood& log_likelihood) {
  // A variance that follows the power of the shaking goes with slope 1; a knee far above the median leaves the quiet as it is.
  constexpr double knee = 10.0, slope = 0.75;
  using More = std::array<double, 12>;
  const auto noise_of = [&](const More& x) {
    Sizes s{};
    std::copy_n(x.begin(), s.size(), s.begin());
    return shaken_by(loudness, with_sizes(start, s), x[10], x[11]);
  };
  More from{};
  const Sizes sizes = sizes_of(start);
  std::copy(sizes.begin(), sizes.end(), from.begin());
  from[10] = knee;
  from[11] = slope;
  const Summit<12> top = climb<12>(from, to_the_top, [&](const More& x) { return log_likelihood(noise_of(x)); });
  return {noise_of(top.at), top.log_likelihood};
}

double integral_density(const NoiseCheck& noise, std::size_t axis, double rate_hz) {
  constexpr std::size_t accelerometers = 3;
  return noise.axes[accelerometers + axis].increment_sigma / std::sqrt(rate_hz);
}

}  // namespace

bool colours_innovations(const PassInput& input, const NoiseCheck& noise) {
  double square = 0.0;  // mean of the axes
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double density = integral_density(noise, axis, input.data->sample_rate_hz);
    square += density * density / 3.0;
  }
  const double T = input.interval_s;
  const double of_force = input.noise.accel_vrw * input.noise.accel_vrw * T * T * T / 3.0;
  return input.noise.observation.state_count() == 0 && square * T >= colours * of_force;
}

bool fit_velocity_noise(PassInput& input, const NoiseCheck& check, const std::vector<Segment>& segments) {
  const NoiseModel& given = input.noise;
  NoiseModel start = given;
  start.axes = {Vector3::Constant(given.gyro_arw), Vector3::Constant(given.accel_vrw), Vector3::Zero()};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    start.axes->accel_integral(static_cast<Eigen::Index>(axis)) =
        std::max(1e-9, integral_density(check, axis, input.data->sample_rate_hz));
  }
  for (const Segment& s : segments) {
    if (s.rotation) {
      start.disturbed.push_back({s.start_s, s.end_s, 1.0});
    }
  }
  const Navigated navigated = navigate(input);
  const auto log_likelihood = [&](const NoiseModel& noise) {
    PassInput trial = input;
    trial.noise = noise;
    trial.navigated = &navigated;
    return run_pass(trial).log_likelihood;
  };
  const std::vector<Loudness> loudness = loudness_of(*input.data, segments, input.interval_s);
  const Fitted best =
      changes_its_loudness(loudness) ? top_beside(loudness, start, log_likelihood) : top_of(start, log_likelihood);
  if (best.log_likelihood < log_likelihood(given) + least_log_gain) {
    return false;
  }
  input.noise = best.noise;
  return true;
}

bool fit_velocity_noise_and_point(PassInput& input, const NoiseCheck& check, const std::vector<Segment>& segments) {
  constexpr int most_rounds = 3;
  constexpr double little = 2.0;  // of the log-likelihood
  const NoiseModel given = input.noise;
  if (!fit_velocity_noise(input, check, segments)) {
    return false;
  }
  for (int round = 0; round < most_rounds; ++round) {
    PassInput moved = input;
    moved.held = false;
    settle(moved);
    if (run_pass(moved).log_likelihood < run_pass(input).log_likelihood + little) {
      break;
    }
    input = moved;
    moved.noise = given;
    if (fit_velocity_noise(moved, check, segments)) {
      input.noise = moved.noise;
    }
  }
  return true;
}

std::optional<NoiseModel> refit_velocity_noise(const NoiseModel& noise,
                                               const std::function<double(const NoiseModel&)>& log_likelihood) {
  if (!noise.axes) {
    return std::nullopt;
  }
  const NoiseModel best = top_of(noise, log_likelihood).noise;
  if (sizes_of(best) == sizes_of(noise)) {
    return std::nullopt;
  }
  return best;
}

}  // namespace selfcal::diagnosis
