#include "estimator/passes/noise_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/statistics/climb.hpp"

namespace selfcal {
namespace {

constexpr int up = 1;                // gyro noise tilts the base: no first-order effect on the vertical
constexpr double improbable = 30.7;  // chi-squared, 3 degrees, once in 10^6
constexpr double most_disturbed = 0.1;
constexpr int rounds = 4;

using Sizes = std::array<double, 6>;  // ARW, VRW, white position, walk north, up, east

StillNoise noise_of(const Sizes& s) { return {s[0], s[1], s[2], Vector3(s[3], s[4], s[5])}; }

std::array<AxisInnovations, 3> innovations(const DriftSeries& series, const StillNoise& noise) {
  std::array<AxisInnovations, 3> out;
  for (int axis = 0; axis < 3; ++axis) {
    filter_axis(series, axis, {noise.accel_vrw, axis == up ? 0.0 : noise.gyro_arw, noise.position_sigma},
                position_walk(noise.position_walk(axis)), out[static_cast<std::size_t>(axis)]);
  }
  return out;
}

double log_likelihood(const DriftSeries& series, const Sizes& sizes) {
  double sum = 0.0;
  for (const AxisInnovations& axis : innovations(series, noise_of(sizes))) {
    sum += axis.log_likelihood;
  }
  return sum;
}

// What does not matter any more is not followed to zero: a density a hundredth of its start is as good as none.
Sizes climbed(const DriftSeries& series, const Sizes& start) {
  const Climb how{.factors = {4.0, 2.0, 1.25, 1.06, 1.03}, .enough = 0.01, .farthest = 1e4};
  return climb<6>(start, how, [&](const Sizes& s) { return log_likelihood(series, s); }).at;
}

// Sum of the squares of the three axes' innovations, each over its variance.
std::vector<double> squares(const DriftSeries& series, const StillNoise& noise) {
  std::vector<double> sum(series.size(), 0.0);
  for (const AxisInnovations& axis : innovations(series, noise)) {
    for (std::size_t k = 0; k < sum.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      sum[k] += axis.value(i) * axis.value(i) / axis.variance(i);
    }
  }
  return sum;
}

// True where a second was added or weighs less than before.
bool weigh(DriftSeries& series, const StillNoise& noise) {
  const std::vector<double> square = squares(series, noise);
  std::vector<double> inflation = series.inflation;
  bool changed = false;
  for (std::size_t k = 0; k < square.size(); ++k) {
    if (square[k] > improbable) {
      inflation[k] *= square[k] / 3.0;
      changed = true;
    }
  }
  const auto disturbed = std::count_if(inflation.begin(), inflation.end(), [](double f) { return f > 1.0; });
  if (static_cast<double>(disturbed) > most_disturbed * static_cast<double>(inflation.size())) {
    return false;
  }
  series.inflation = std::move(inflation);
  return changed;
}

}  // namespace

StillNoiseFit fit_still_noise(DriftSeries series, const StillNoise& start) {
  series.inflation.assign(series.size(), 1.0);
  const Vector3& walk = start.position_walk;
  Sizes sizes = climbed(series, {start.gyro_arw, start.accel_vrw, start.position_sigma, walk(0), walk(1), walk(2)});
  for (int round = 0; round < rounds && weigh(series, noise_of(sizes)); ++round) {
    sizes = climbed(series, sizes);
  }
  StillNoiseFit fit;
  fit.noise = noise_of(sizes);
  for (std::size_t k = 0; k < series.size(); ++k) {
    if (series.inflation[k] > 1.0) {
      fit.disturbed.push_back({series.start_s[k], series.end_s[k], series.inflation[k]});
    }
  }
  std::sort(fit.disturbed.begin(), fit.disturbed.end(),
            [](const Disturbance& a, const Disturbance& b) { return a.start_s < b.start_s; });
  return fit;
}

}  // namespace selfcal
