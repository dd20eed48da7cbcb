// The 24-parameter error model (tools/handbook/frames-and-signs.md): what a sensor adds to the truth.
#pragma once

#include "estimator/geometry/rotation.hpp"
#include "sim_ins/config.hpp"

namespace selfcal::sim {

Vector3 accel_error(const SensorErrors& errors, const Vector3& f_ib_b);     // m/s^2
Vector3 gyro_error(const SensorErrors& errors, const Vector3& omega_ib_b);  // rad/s

}  // namespace selfcal::sim
