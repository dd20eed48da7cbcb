// The 24 sensor errors: one table with their order, names, units. Everything that lists them (state vector, JSON,
// coefficient set on the bus, LCM, report) goes by it.
//
// Sensor output = truth + error (tools/handbook/frames-and-signs.md), f and omega in b:
//   df = bias + K+ max(f,0) + K- max(-f,0) per axis, then df_y += A_yx f_x, df_z += A_zx f_x + A_zy f_y
//   dw = drift + K_G w per axis, then dw_x += G_xy w_y + G_xz w_z, and so on.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace selfcal {

inline constexpr int sensor_parameter_count = 24;

// First index of each group in the table.
namespace parameter {
inline constexpr int accel_bias = 0;           // x y z, m/s^2
inline constexpr int gyro_drift = 3;           // x y z, rad/s
inline constexpr int accel_scale_pos = 6;      // x y z
inline constexpr int accel_scale_neg = 9;      // x y z
inline constexpr int accel_misalignment = 12;  // yx zx zy, rad
inline constexpr int gyro_scale = 15;          // x y z
inline constexpr int gyro_misalignment = 18;   // xy xz yx yz zx zy, rad
}  // namespace parameter

struct SensorParameter {
  std::string_view name;  // as in the JSON, e.g. "accel_bias_x"
  std::string_view unit;  // as in the JSON: ug, deg/h, ppm, arcsec
  double si_per_unit;     // value_si = value_in_unit * si_per_unit
};

extern const std::array<SensorParameter, sensor_parameter_count> sensor_parameters;

std::optional<int> find_sensor_parameter(std::string_view name);

}  // namespace selfcal
