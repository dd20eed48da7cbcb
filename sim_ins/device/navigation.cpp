#include "sim_ins/device/navigation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::sim {

FreeInertialNavigation::FreeInertialNavigation(const earth::Position& start, const Matrix3& C_nb,
                                               const Coefficients& coefficients)
    : start_(start),
      c_(coefficients),
      attitude_(C_nb),
      latitude_(start.latitude),
      longitude_(start.longitude),
      north_radius_(earth::meridian_radius(start.latitude) + start.height),
      east_radius_((earth::prime_vertical_radius(start.latitude) + start.height) * std::cos(start.latitude)) {
  constexpr auto K = static_cast<std::size_t>(parameter::gyro_scale);
  constexpr auto G = static_cast<std::size_t>(parameter::gyro_misalignment);
  Matrix3 model;
  model << 1.0 + c_[K], c_[G], c_[G + 1],     //
      c_[G + 2], 1.0 + c_[K + 1], c_[G + 3],  //
      c_[G + 4], c_[G + 5], 1.0 + c_[K + 2];
  gyro_inverse_ = model.inverse();
}

Vector3 FreeInertialNavigation::compensated_rate(const Vector3& delta_theta, double dt) const {
  constexpr auto drift = static_cast<std::size_t>(parameter::gyro_drift);
  return gyro_inverse_ * (delta_theta / dt - Vector3(c_[drift], c_[drift + 1], c_[drift + 2]));
}

Vector3 FreeInertialNavigation::compensated_force(const Vector3& delta_v, double dt) const {
  constexpr auto bias = static_cast<std::size_t>(parameter::accel_bias);
  constexpr auto positive = static_cast<std::size_t>(parameter::accel_scale_pos);
  constexpr auto negative = static_cast<std::size_t>(parameter::accel_scale_neg);
  constexpr auto angles = static_cast<std::size_t>(parameter::accel_misalignment);
  Vector3 f = Vector3::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    double output = delta_v(i) / dt - c_[bias + axis];
    if (axis == 1) {
      output -= c_[angles] * f.x();
    } else if (axis == 2) {
      output -= c_[angles + 1] * f.x() + c_[angles + 2] * f.y();
    }
    f(i) = output >= 0.0 ? output / (1.0 + c_[positive + axis]) : output / (1.0 - c_[negative + axis]);
  }
  return f;
}

void FreeInertialNavigation::step(const Vector3& delta_theta, const Vector3& delta_v, double dt) {
  const Vector3 turn = dt * compensated_rate(delta_theta, dt);
  const Vector3 gain = dt * compensated_force(delta_v, dt);
  const earth::Position here{latitude_, longitude_, start_.height};
  const Vector3 v_n(north_velocity_, 0.0, east_velocity_);
  const Vector3 omega_ie = earth::omega_ie_n(latitude_);
  const Vector3 omega_en = earth::omega_en_n(here, v_n);

  const Vector3 change = attitude_ * (gain + 0.5 * turn.cross(gain)) - dt * (2.0 * omega_ie + omega_en).cross(v_n);
  const double north_before = north_velocity_;
  const double east_before = east_velocity_;
  north_velocity_ += change.x();
  east_velocity_ += change.z();
  const double radius_north = earth::meridian_radius(latitude_) + start_.height;
  const double radius_east = (earth::prime_vertical_radius(latitude_) + start_.height) * std::cos(latitude_);
  latitude_ += dt * 0.5 * (north_before + north_velocity_) / radius_north;
  longitude_ += dt * 0.5 * (east_before + east_velocity_) / radius_east;

  attitude_ =
      quaternion_from_rotation_vector(-dt * (omega_ie + omega_en)) * attitude_ * quaternion_from_rotation_vector(turn);
  attitude_.normalize();
  max_horizontal_ = std::max(max_horizontal_, std::hypot(north_m(), east_m()));
}

}  // namespace selfcal::sim
