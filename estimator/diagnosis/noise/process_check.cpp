#include "estimator/diagnosis/noise/process_check.hpp"

#include <cmath>
#include <span>

#include "estimator/geometry/units.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

namespace {

// Square of the difference of the means of two halves, each of this length, of a process of unit size.
double square_of_difference(const BiasKernel& kernel, double half_s) {
  return kernel.covariance(0.0, half_s, 0.0, half_s) + kernel.covariance(half_s, 2.0 * half_s, half_s, 2.0 * half_s) -
         2.0 * kernel.covariance(0.0, half_s, half_s, 2.0 * half_s);
}

}  // namespace

// Differences of the means of both halves of each dwell: white noise 4 N^2/T, and what the process gives, (2/3) q^2 T/2 of a walk.
bool goes_on_inside_dwells(const ImuData& data, const NoiseModel& noise, const BiasProcess& process) {
  const double asd = process.of_gyro() ? noise.gyro_arw : noise.accel_vrw;
  const double size = process.size * map_unit(process.axes.front());
  const std::span<const std::array<double, 3>> increments = process.of_gyro() ? data.delta_theta : data.delta_v;
  double seen = 0.0, white = 0.0, expected = 0.0;
  for (const Segment& s : find_segments(data)) {
    const auto margin = static_cast<std::size_t>(2.0 * data.sample_rate_hz);
    if (s.rotation || s.last - s.first < 20 * margin) {
      continue;
    }
    const std::size_t half = (s.last - s.first - 2 * margin) / 2;
    const double length = static_cast<double>(half) / data.sample_rate_hz;
    for (const int axis : process.axes) {
      const auto column = static_cast<std::size_t>(axis % 3);
      double difference = 0.0;
      for (std::size_t i = 0; i < half; ++i) {
        difference += increments[s.first + margin + half + i][column] - increments[s.first + margin + i][column];
      }
      seen += difference * difference / (length * length);
      white += 2.0 * asd * asd / length;
      expected += size * size * square_of_difference(process.kernel, length);
    }
  }
  // Over n dwells a walk's sum is its expectation times chi-squared of n over n: below 0.3 of it in 0.25 % of all cases for the
  // 17 dwells of the shortest schedule. Jumps leave the white noise alone, which is below 0.3 of the sum from a walk of 2.3
  // times its size on; below twice nothing can be told.
  constexpr double least_share = 0.3, seen_beside_noise = 2.0;
  return expected < seen_beside_noise * white || seen > least_share * (white + expected);
}

}  // namespace selfcal::diagnosis
