#include "estimator/diagnosis/catalogue.hpp"

#include "estimator/diagnosis/effects/declare.hpp"

namespace selfcal::diagnosis {

std::vector<EffectParameter> axis_parameters(const std::string& unit, double si_per_unit, double typical) {
  return {{"x", unit, si_per_unit, typical}, {"y", unit, si_per_unit, typical}, {"z", unit, si_per_unit, typical}};
}

std::vector<EffectParameter> matrix_parameters(const std::string& unit, double si_per_unit, double typical) {
  std::vector<EffectParameter> all;
  for (const char* name : {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"}) {
    all.push_back({name, unit, si_per_unit, typical});
  }
  return all;
}

void add_matrix(Columns columns, const Vector3& v) {
  for (Eigen::Index row = 0; row < 3; ++row) {
    columns.block<1, 3>(row, 3 * row) += v.transpose();
  }
}

const std::vector<Effect>& catalogue() {
  static const std::vector<Effect> all = {
      imu_lever_arm(),
      accel_gyro_time_offset(),
      accel_relaxation(),
      accel_bias_ramp(),
      accel_temperature(),
      accel_temperature_measured(),
      accel_scale_temperature(),
      accel_scale_temperature_measured(),
      accel_quadratic(),
      accel_cubic(),
      gyro_scale_asymmetry(),
      gyro_scale_nonlinearity(),
      gyro_drift_ramp(),
      gyro_temperature(),
      gyro_temperature_measured(),
      gyro_scale_temperature(),
      gyro_scale_temperature_measured(),
      gyro_dead_zone(),
      gyro_g_sensitivity(),
      gyro_magnetic_sensitivity(),
      accel_size_effect(),
      triad_flexure(),
      accel_cross_coupling(),
      base_settling(),
      base_sway(),
      wrong_site(),
  };
  return all;
}

}  // namespace selfcal::diagnosis
