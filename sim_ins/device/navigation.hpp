// The INS's own navigation: compensates the increments with the coefficients in force and navigates free-inertially
// from a known start at rest. Horizontal channels only; height is held, as a ship's is.
//
// Written apart from the estimator on purpose: a shared error would hide.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "estimator/geometry/earth.hpp"
#include "protocol/ins_interface/coefficients.hpp"

namespace selfcal::sim {

class FreeInertialNavigation {
 public:
  using Coefficients = std::array<double, ins::coefficient_count>;  // SI, order of geometry's table

  FreeInertialNavigation(const earth::Position& start, const Matrix3& C_nb, const Coefficients& coefficients);

  // One interval: measured increments, rad and m/s.
  void step(const Vector3& delta_theta, const Vector3& delta_v, double dt);

  double north_m() const { return (latitude_ - start_.latitude) * north_radius_; }
  double east_m() const { return (longitude_ - start_.longitude) * east_radius_; }
  double max_horizontal_m() const { return max_horizontal_; }

 private:
  Vector3 compensated_rate(const Vector3& delta_theta, double dt) const;
  Vector3 compensated_force(const Vector3& delta_v, double dt) const;

  earth::Position start_;
  Coefficients c_;
  Matrix3 gyro_inverse_;
  Eigen::Quaterniond attitude_;  // b to n
  double latitude_, longitude_;
  double north_velocity_ = 0.0, east_velocity_ = 0.0;
  double north_radius_, east_radius_;  // lengths of a radian of latitude and longitude at the start
  double max_horizontal_ = 0.0;
};

}  // namespace selfcal::sim
