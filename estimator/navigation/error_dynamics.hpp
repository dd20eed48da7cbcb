// Error dynamics of a strapdown INS at rest at a known site, over one update interval.
//
// States as in StateLayout, n = north up east, equations (D1)-(D5) of estimator/README.md. `sign` is +1 for forward
// and -1 for reverse navigation: time, and with it Earth's rotation and every integral, runs backwards.
#pragma once

#include <Eigen/Core>

#include "estimator/filter/state_layout.hpp"
#include "estimator/geometry/earth.hpp"

namespace selfcal {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

// What does not change during a recording.
struct SiteModel {
  explicit SiteModel(const earth::Position& site);

  Vector3 omega_ie_n;  // rad/s
  Vector3 gravity_n;   // (0, -g, 0), m/s^2
  Matrix9 F_rest;      // error dynamics without the specific force, 1/s
};

// exp(sign * F * length), F = F_rest + the coupling f_n x phi; third order: the rest is (|F| length)^4/24, below
// 1e-13 of a state for length <= 2 s.
Matrix9 transition(const SiteModel& site, const Vector3& f_n, double length_s, double sign);

// Process noise of one interval, factored: L diag(q) L^T, L unit lower triangular.
struct ProcessNoise {
  Matrix9 L;
  Vector9 q;
};

// White gyro and accelerometer noise (rad/s/sqrt(Hz), m/s^2/sqrt(Hz), the same on all axes) integrated over
// `length_s` under the specific force of a base at rest.
ProcessNoise process_noise(const SiteModel& site, double gyro_arw, double accel_vrw, double length_s, double sign);

// Spectral densities of white noise along the axes of n, where those of b are not alike.
struct WhiteNoise {
  Matrix3 rate = Matrix3::Zero();      // (rad/s)^2/Hz
  Matrix3 force = Matrix3::Zero();     // (m/s^2)^2/Hz
  Matrix3 velocity = Matrix3::Zero();  // (m/s)^2/Hz, of the accelerometers' integral: the position walks by it
};
ProcessNoise process_noise(const SiteModel& site, const WhiteNoise& noise, double length_s, double sign);

}  // namespace selfcal
