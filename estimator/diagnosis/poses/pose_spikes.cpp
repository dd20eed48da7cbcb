#include "estimator/diagnosis/poses/pose_spikes.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

using Series = std::vector<std::array<double, 3>>;

constexpr std::size_t reach = 5;     // samples on either side
constexpr double far_off = 8.0;      // of the largest of ten steps of white noise: 28 sigma
constexpr std::size_t one_in = 200;  // more are no spikes but how the sensor reads

// The usual step, so that a coarse reading that stands still for ten samples is no measure.
double usual_step(const Series& series, std::size_t axis) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < series.size(); ++i) {
    if (series[i][axis] != series[i - 1][axis]) {
      steps.push_back(std::abs(series[i][axis] - series[i - 1][axis]));
    }
  }
  return steps.empty() ? 0.0 : median(std::move(steps));
}

bool stands_alone(const Series& series, std::size_t axis, std::size_t i, double usual) {
  const double before = series[i][axis] - series[i - 1][axis], behind = series[i][axis] - series[i + 1][axis];
  const double off = std::min(std::abs(before), std::abs(behind));
  if (before * behind <= 0.0 || off <= far_off * usual) {
    return false;
  }
  double around = std::abs(series[i + 1][axis] - series[i - 1][axis]);
  for (std::size_t k = i - reach + 1; k < i; ++k) {
    around = std::max(around, std::abs(series[k][axis] - series[k - 1][axis]));
  }
  for (std::size_t k = i + 2; k <= i + reach; ++k) {
    around = std::max(around, std::abs(series[k][axis] - series[k - 1][axis]));
  }
  return off > far_off * around;
}

std::size_t of_axis(Series& series, std::size_t axis) {
  const double usual = usual_step(series, axis);
  std::vector<std::size_t> found;
  for (std::size_t i = reach; i + reach < series.size(); ++i) {
    if (stands_alone(series, axis, i, usual)) {
      found.push_back(i);
    }
  }
  if (found.size() * one_in > series.size()) {
    return 0;
  }
  for (const std::size_t i : found) {
    series[i][axis] = 0.5 * (series[i - 1][axis] + series[i + 1][axis]);
  }
  return found.size();
}

}  // namespace

std::size_t take_out_spikes(PoseInput& input) {
  std::size_t count = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    count += of_axis(input.gyro, axis) + of_axis(input.accel, axis);
  }
  return count;
}

}  // namespace selfcal::diagnosis
