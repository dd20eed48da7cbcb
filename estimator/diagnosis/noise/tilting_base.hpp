// A base that nothing turns on, as the sensors feel its tilt. Private to this folder.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstddef>

#include "estimator/models/imu_data.hpp"

namespace selfcal::diagnosis {

// Gyros, accelerometers, and the angle about either tilt axis that the gyros integrate to.
constexpr Eigen::Index tilt_channels = 8, first_angle = 6;
// Rates about, and specific force across: what a tilt of the base makes of both. Force: angle times g.
struct TiltAxis {
  Vector3 about, across;
};
struct Base {
  double g = 0.0;
  bool level = false;            // x of b, within 11 deg
  std::array<TiltAxis, 2> axes;  // roll, pitch
};

using Piece = Eigen::Matrix<double, tilt_channels, Eigen::Dynamic>;

// Axes by the mean force of the samples [first, last).
Base base_of(const ImuData& data, std::size_t first, std::size_t last);

// Increments and angles of n samples, less their means. A gyro's constant drift is no tilt: the angles have the slope of the force.
Piece piece_of(const ImuData& data, const Base& base, std::size_t at, std::size_t n);

}  // namespace selfcal::diagnosis
