// One function per file of this folder.
#pragma once

#include "estimator/diagnosis/effect.hpp"

namespace selfcal::diagnosis {

Effect imu_lever_arm();
Effect accel_gyro_time_offset();
Effect accel_relaxation();
Effect accel_bias_ramp();
Effect accel_temperature();
Effect accel_temperature_measured();
Effect accel_scale_temperature();
Effect accel_scale_temperature_measured();
Effect accel_quadratic();
Effect accel_cubic();
Effect gyro_scale_asymmetry();
Effect gyro_scale_nonlinearity();
Effect gyro_drift_ramp();
Effect gyro_temperature();
Effect gyro_temperature_measured();
Effect gyro_scale_temperature();
Effect gyro_scale_temperature_measured();
Effect gyro_dead_zone();
Effect gyro_g_sensitivity();
Effect gyro_magnetic_sensitivity();
Effect accel_size_effect();
Effect triad_flexure();
Effect accel_cross_coupling();
Effect base_settling();
Effect base_sway();
Effect wrong_site();

}  // namespace selfcal::diagnosis
