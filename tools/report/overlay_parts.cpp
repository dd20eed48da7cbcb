#include "tools/report/overlay_parts.hpp"

#include "estimator/geometry/units.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::report {

double increment(const ImuData& data, std::size_t sensor, std::size_t i) {
  return sensor < 3 ? data.delta_theta[i][sensor] : data.delta_v[i][sensor - 3];
}

double page_unit(std::size_t sensor) { return sensor < 3 ? units::degree_per_hour : units::micro_g; }

std::string sensor_name(std::size_t sensor) {
  return std::string(sensor < 3 ? "gyro " : "accelerometer ") + "xyz"[sensor % 3];
}

std::vector<Range> quiet(const ImuData& data) {
  constexpr double settling_s = 2.0;  // left out at both ends of a dwell
  const auto margin = static_cast<std::size_t>(settling_s * data.sample_rate_hz);
  std::vector<Range> ranges;
  for (const Segment& s : observed(find_segments(data), data)) {
    if (!s.rotation && s.last - s.first > 4 * margin) {
      ranges.push_back({s.first + margin, s.last - margin});
    }
  }
  return ranges;
}

}  // namespace selfcal::report
