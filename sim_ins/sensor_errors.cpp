#include "sim_ins/sensor_errors.hpp"

namespace selfcal::sim {
namespace {

Vector3 group(const SensorErrors& errors, int first) {
  const auto i = static_cast<std::size_t>(first);
  return {errors[i], errors[i + 1], errors[i + 2]};
}

}  // namespace

// tools/handbook/frames-and-signs.md: df = bias + K+ max(f,0) + K- max(-f,0), then the lower-triangular misalignment.
Vector3 accel_error(const SensorErrors& errors, const Vector3& f) {
  const Vector3 A = group(errors, parameter::accel_misalignment);  // yx zx zy
  Vector3 df = group(errors, parameter::accel_bias) +
               group(errors, parameter::accel_scale_pos).cwiseProduct(f.cwiseMax(0.0)) +
               group(errors, parameter::accel_scale_neg).cwiseProduct((-f).cwiseMax(0.0));
  df.y() += A[0] * f.x();
  df.z() += A[1] * f.x() + A[2] * f.y();
  return df;
}

// dw = drift + K_G w, then the six misalignments.
Vector3 gyro_error(const SensorErrors& errors, const Vector3& w) {
  const Vector3 G_x_y = group(errors, parameter::gyro_misalignment);      // xy xz yx
  const Vector3 G_y_z = group(errors, parameter::gyro_misalignment + 3);  // yz zx zy
  Vector3 dw = group(errors, parameter::gyro_drift) + group(errors, parameter::gyro_scale).cwiseProduct(w);
  dw.x() += G_x_y[0] * w.y() + G_x_y[1] * w.z();
  dw.y() += G_x_y[2] * w.x() + G_y_z[0] * w.z();
  dw.z() += G_y_z[1] * w.x() + G_y_z[2] * w.y();
  return dw;
}

}  // namespace selfcal::sim
