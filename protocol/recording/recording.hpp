// One self-calibration recording, in memory: recording interchange format version 1. SI and radians.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace selfcal {

struct Recording {
  std::string serial;
  double sample_rate_hz = 0.0;  // nominal
  double latitude_deg = 0.0;    // WGS-84
  double longitude_deg = 0.0;
  double height_m = 0.0;  // ellipsoidal
  std::optional<double> dwell_s;
  std::optional<double> rotation_s;
  std::string start_time_utc;  // ISO 8601, empty: unknown
  bool gimbal_absent = false;  // said to have none: its read-outs are zeros and say nothing

  // N samples. time_s is the end of each sample's interval.
  std::vector<double> time_s;
  std::vector<std::array<double, 3>> delta_theta_rad;  // b axes, uncompensated
  std::vector<std::array<double, 3>> delta_v_mps;      // b axes, uncompensated
  std::vector<double> gimbal_outer_rad;
  std::vector<double> gimbal_inner_rad;

  std::vector<double> temperature_c;  // N x temperature_channels, row after row; empty: none
  std::size_t temperature_channels = 0;
  std::vector<std::array<double, 2>> schedule_deg;  // outer, inner; empty: none

  std::size_t size() const { return time_s.size(); }
};

}  // namespace selfcal
