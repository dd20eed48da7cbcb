#include "estimator/passes/noise_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace selfcal {
namespace {

constexpr int up = 1;                // gyro noise tilts the base: no first-order effect on the vertical
constexpr double improbable = 30.7;  // chi-squared, 3 degrees, once in 10^6
constexpr double most_disturbed = 0.1;
constexpr int rounds = 4;

using Logs = std::array<double, 6>;  // ln of ARW, VRW, white position, walk north, up, east

StillNoise noise_of(const Logs& logs) {
  return {std::exp(logs[0]), std::exp(logs[1]), std::exp(logs[2]),
          Vector3(std::exp(logs[3]), std::exp(logs[4]), std::exp(logs[5]))};
}

std::array<AxisInnovations, 3> innovations(const DriftSeries& series, const StillNoise& noise) {
  std::array<AxisInnovations, 3> out;
  for (int axis = 0; axis < 3; ++axis) {
    filter_axis(series, axis, {noise.accel_vrw, axis == up ? 0.0 : noise.gyro_arw, noise.position_sigma},
                position_walk(noise.position_walk(axis)), out[static_cast<std::size_t>(axis)]);
  }
  return out;
}

double log_likelihood(const DriftSeries& series, const Logs& logs) {
  double sum = 0.0;
  for (const AxisInnovations& axis : innovations(series, noise_of(logs))) {
    sum += axis.log_likelihood;
  }
  return sum;
}

// Coordinate by coordinate, by ever smaller factors. What does not matter any more is not followed to zero: a density a
// hundredth of its start is as good as none.
Logs climb(const DriftSeries& series, const Logs& start) {
  Logs best = start;
  double top = log_likelihood(series, best);
  constexpr double enough = 0.01;  // of the log likelihood
  const double farthest = std::log(1e4);
  for (const double step : {std::log(4.0), std::log(2.0), std::log(1.25), std::log(1.06), std::log(1.03)}) {
    constexpr int most_rounds = 30;
    double before = -HUGE_VAL;
    for (int round = 0; round < most_rounds && top > before + enough; ++round) {
      before = top;
      for (std::size_t k = 0; k < best.size(); ++k) {
        for (const double move : {step, -step}) {
          Logs trial = best;
          trial[k] += move;
          const double found = std::abs(trial[k] - start[k]) > farthest ? -HUGE_VAL : log_likelihood(series, trial);
          if (found > top) {
            top = found;
            best = trial;
            break;
          }
        }
      }
    }
  }
  return best;
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
  Logs logs{};
  logs[0] = std::log(start.gyro_arw);
  logs[1] = std::log(start.accel_vrw);
  logs[2] = std::log(start.position_sigma);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    logs[3 + axis] = std::log(start.position_walk(static_cast<Eigen::Index>(axis)));
  }
  logs = climb(series, logs);
  for (int round = 0; round < rounds && weigh(series, noise_of(logs)); ++round) {
    logs = climb(series, logs);
  }
  StillNoiseFit fit;
  fit.noise = noise_of(logs);
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
