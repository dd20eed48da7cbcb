#include "estimator/geometry/sensor_parameters.hpp"

#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

constexpr SensorParameter bias(std::string_view name) { return {name, "ug", units::micro_g}; }
constexpr SensorParameter drift(std::string_view name) { return {name, "deg/h", units::degree_per_hour}; }
constexpr SensorParameter scale(std::string_view name) { return {name, "ppm", units::ppm}; }
constexpr SensorParameter angle(std::string_view name) { return {name, "arcsec", units::arcsecond}; }

}  // namespace

const std::array<SensorParameter, sensor_parameter_count> sensor_parameters = {
    bias("accel_bias_x"),           bias("accel_bias_y"),           bias("accel_bias_z"),
    drift("gyro_drift_x"),          drift("gyro_drift_y"),          drift("gyro_drift_z"),
    scale("accel_scale_pos_x"),     scale("accel_scale_pos_y"),     scale("accel_scale_pos_z"),
    scale("accel_scale_neg_x"),     scale("accel_scale_neg_y"),     scale("accel_scale_neg_z"),
    angle("accel_misalignment_yx"), angle("accel_misalignment_zx"), angle("accel_misalignment_zy"),
    scale("gyro_scale_x"),          scale("gyro_scale_y"),          scale("gyro_scale_z"),
    angle("gyro_misalignment_xy"),  angle("gyro_misalignment_xz"),  angle("gyro_misalignment_yx"),
    angle("gyro_misalignment_yz"),  angle("gyro_misalignment_zx"),  angle("gyro_misalignment_zy"),
};

std::optional<int> find_sensor_parameter(std::string_view name) {
  for (int i = 0; i < sensor_parameter_count; ++i) {
    if (sensor_parameters[static_cast<std::size_t>(i)].name == name) {
      return i;
    }
  }
  return std::nullopt;
}

}  // namespace selfcal
