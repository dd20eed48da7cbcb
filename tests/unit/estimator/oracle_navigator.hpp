// A nonlinear strapdown navigator for tests: the full equations over the ellipsoid, integrated by Runge and Kutta's
// fourth order from continuous motion. It shares Earth's constants with the estimator and nothing else.
#pragma once

#include <functional>

#include "estimator/geometry/earth.hpp"
#include "sim_ins/config.hpp"

namespace selfcal::test {

// An IMU on a gimbal at rest on the Earth: the gimbal's outer axis turns at a constant rate.
struct TurningGimbal {
  earth::Position site;
  Attitude vehicle;
  double outer_start = 0.0, outer_rate = 0.0, inner = 0.0;  // rad, rad/s

  Matrix3 C_nb(double t) const;
  Vector3 omega_ib_b(double t) const;
  Vector3 f_ib_b(double t) const;
};

// What the navigator starts from, and navigates with, differently from the truth. Positions in m along n.
struct Perturbation {
  Vector3 position = Vector3::Zero(), velocity = Vector3::Zero(), attitude = Vector3::Zero();
  sim::SensorErrors errors{};
};

// Navigates from t = begin to t = end (backwards where end < begin), starting at the truth but for the perturbation.
// Returns the error at the end: position (m along n), velocity, and phi of C_computed = (I - [phi x]) C_true, against
// the same navigation without perturbation. [9]
Eigen::Matrix<double, 9, 1> navigation_error(const TurningGimbal& motion, const Perturbation& perturbation,
                                             double begin, double end);

}  // namespace selfcal::test
