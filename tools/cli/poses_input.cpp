#include "tools/cli/poses_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/recording/atomic_file.hpp"

namespace selfcal::cli {

diagnosis::PoseInput pose_input_of(const Recording& recording) {
  diagnosis::PoseInput input;
  input.time_s = recording.time_s;
  const auto rates = [&recording](const std::vector<std::array<double, 3>>& increments) {
    std::vector<std::array<double, 3>> all = increments;
    for (std::array<double, 3>& row : all) {
      for (double& value : row) {
        value *= recording.sample_rate_hz;
      }
    }
    return all;
  };
  input.gyro = rates(recording.delta_theta_rad);
  input.accel = rates(recording.delta_v_mps);
  input.accel_unit = 1.0;
  input.gravity = earth::normal_gravity(recording.latitude_deg * units::degree, recording.height_m);
  input.latitude = recording.latitude_deg * units::degree;
  for (std::size_t i = 0; i < recording.temperature_c.size(); i += recording.temperature_channels) {
    input.temperature_c.push_back(recording.temperature_c[i]);
  }
  const auto zero = [](const std::vector<double>& angles) {
    return std::all_of(angles.begin(), angles.end(), [](double angle) { return angle == 0.0; });
  };
  if (!zero(recording.gimbal_outer_rad) || !zero(recording.gimbal_inner_rad)) {
    input.outer = recording.gimbal_outer_rad;
    input.inner = recording.gimbal_inner_rad;
  }
  return input;
}

Expected<diagnosis::PoseInput> read_raw_poses(const std::string& path, const RawColumns& columns) {
  constexpr std::size_t limit = 256U << 20U;
  const Expected<std::string> text = read_text_file(path, limit);
  if (!text) {
    return tl::unexpected(text.error());
  }
  diagnosis::PoseInput input;
  std::string_view rest = *text;
  std::size_t line_number = 0;
  const bool both = columns.sensors == diagnosis::Sensors::both;
  std::vector<double> row(std::max({std::size_t{both ? 7U : 4U}, columns.angle, columns.temperature}));
  input.sensors = columns.sensors;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    std::string_view line = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
    if (++line_number == 1 || line.empty()) {
      continue;
    }
    std::fill(row.begin(), row.end(), 0.0);
    for (std::size_t k = 0; k < row.size(); ++k) {
      const auto [stop, error] = std::from_chars(line.data(), line.data() + line.size(), row[k]);
      if (error != std::errc{} || !std::isfinite(row[k])) {
        return fail(ErrorKind::bad_input, fmt::format("{}: line {}, column {}: {} is no number", path, line_number,
                                                      k + 1, line.substr(0, 20)));
      }
      line.remove_prefix(static_cast<std::size_t>(stop - line.data()));
      line.remove_prefix(line.starts_with(',') ? 1 : 0);
    }
    if (!input.time_s.empty() && row[0] <= input.time_s.back()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: line {}: time {} does not increase", path, line_number, row[0]));
    }
    input.time_s.push_back(row[0]);
    const std::array<double, 3> first{row[1], row[2], row[3]}, none{};
    input.gyro.push_back(columns.sensors == diagnosis::Sensors::accelerometers ? none : first);
    input.accel.push_back(both                                                    ? std::array{row[4], row[5], row[6]}
                          : columns.sensors == diagnosis::Sensors::accelerometers ? first
                                                                                  : none);
    if (columns.temperature > 0) {
      input.temperature_c.push_back(row[columns.temperature - 1]);
    }
    if (columns.angle > 0) {
      input.outer.push_back(row[columns.angle - 1] * units::degree);
      input.inner.push_back(0.0);
    }
  }
  return input;
}

}  // namespace selfcal::cli
