#include "estimator/diagnosis/poses/pose_claims.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

bool is_added_up(const std::vector<std::array<double, 3>>& series) {
  double sum = 0.0, square = 0.0, least = HUGE_VAL, most = 0.0;
  for (std::size_t i = 1; i < series.size(); ++i) {
    const double step = (at(series, i) - at(series, i - 1)).norm(), size = at(series, i).norm();
    sum += step;
    square += step * step;
    least = std::min(least, size);
    most = std::max(most, size);
  }
  const auto n = static_cast<double>(series.size() - 1);
  const double mean = sum / n;
  constexpr double alike = 0.25;  // rms of their sizes: of noise it is 0.42 and more
  constexpr double far = 100.0;   // steps
  return mean > 0.0 && square / n - mean * mean < alike * alike * mean * mean && most - least > far * mean;
}

// Whether all axes change nearly from row to row: a coarse quantum along gravity would hide the noise of its size.
bool is_fine(const std::vector<std::array<double, 3>>& series, std::size_t first, std::size_t last) {
  std::array<std::size_t, 3> same{};
  for (std::size_t i = first + 1; i < last; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      same.at(axis) += series[i].at(axis) == series[i - 1].at(axis) ? 1 : 0;
    }
  }
  return 2 * *std::max_element(same.begin(), same.end()) < last - first;
}

// By second differences, which a slow turn does not show.
bool is_direction(const std::vector<std::array<double, 3>>& series) {
  constexpr std::size_t block = 20, least = 20;
  constexpr double none = 1e-3;  // of the variance of an axis across it
  std::vector<double> ratios;
  ratios.reserve(series.size() / block + 1);
  for (std::size_t first = 0; first + block <= series.size(); first += block) {
    double along = 0.0, all = 0.0;
    for (std::size_t i = first + 2; i < first + block; ++i) {
      const Vector3 a = at(series, i - 2), b = at(series, i - 1), c = at(series, i);
      along += std::pow(a.norm() - 2.0 * b.norm() + c.norm(), 2);
      all += (a - 2.0 * b + c).squaredNorm();
    }
    if (all > 0.0 && is_fine(series, first, first + block)) {
      ratios.push_back(2.0 * along / all);
    }
  }
  return ratios.size() >= least && 2 * block * ratios.size() >= series.size() && median(std::move(ratios)) < none;
}

// Rate across gravity beside a constant one, rad/s, in seconds through which gravity stands still: the middle one, where it is a turn's; else 0.
double turns_beside_gravity(const PoseInput& input) {
  constexpr double second = 1.0, still = 0.5 * units::degree, turning = 30.0 * units::degree;
  const auto length = static_cast<std::size_t>(std::lround(second * sample_rate(input)));
  constexpr std::size_t shortest = 6, least = 10;
  if (length < shortest) {
    return 0.0;
  }
  std::vector<Vector3> up, rates;
  up.reserve(input.time_s.size() / length + 1);
  rates.reserve(up.capacity());
  for (std::size_t first = 0; first + length <= input.time_s.size(); first += length) {
    Vector3 early = Vector3::Zero(), late = Vector3::Zero(), rate = Vector3::Zero();
    for (std::size_t i = 0; i < length; ++i) {
      (2 * i < length ? early : late) += at(input.accel, first + i);
      rate += at(input.gyro, first + i) / static_cast<double>(length);
    }
    if (early.normalized().cross(late.normalized()).norm() < still) {
      up.push_back((early + late).normalized());
      rates.push_back(rate);
    }
  }
  if (rates.size() < least) {
    return 0.0;
  }
  const Vector3 usual = median_of_axes(rates);
  std::vector<double> across(rates.size());
  std::transform(
      rates.begin(), rates.end(), up.begin(), across.begin(),
      [&usual](const Vector3& rate, const Vector3& u) { return (rate - usual - (rate - usual).dot(u) * u).norm(); });
  const double middle = median(std::move(across));
  return middle > turning ? middle : 0.0;
}

}  // namespace

std::string no_readings(const PoseInput& input) {
  if (std::string none = no_readings(input.gyro, input.accel); !none.empty()) {
    return none;
  }
  if (input.sensors == Sensors::gyros || input.accel.size() < 3) {
    return {};
  }
  if (is_added_up(input.accel)) {
    return "the accelerometers are added up: from row to row they change by one size throughout, as accumulated "
           "increments "
           "do; their differences from row to row are wanted";
  }
  if (is_direction(input.accel)) {
    return "the accelerometers have been divided by their size, which has no noise: a direction, from which neither "
           "bias "
           "nor scale factor follows";
  }
  const double across =
      input.sensors == Sensors::both && input.gyros_si && input.gyro_unit == 1.0 ? turns_beside_gravity(input) : 0.0;
  if (across > 0.0) {
    std::array<char, 200> text{};
    std::snprintf(
        text.data(), text.size(),
        "while gravity stands still the gyros tell of %.3g deg/s across it: no rates (angles, say), or another "
        "unit",
        across / units::degree);
    return text.data();
  }
  return {};
}

}  // namespace selfcal::diagnosis
