// How the axes of gyros and accelerometers lie to each other, to the gimbal's and to the Earth's, as their motion shows.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "protocol/import/motion.hpp"

namespace selfcal::import {

// Signed permutations of three axes: the 24 rotations among them; the other 24 are their negatives.
const std::vector<Matrix3>& axis_rotations();

// v = sign * rotation * v_file explains what was seen.
struct AxisFit {
  Matrix3 rotation = Matrix3::Identity();
  double sign = 1.0;           // -1: left-handed among each other
  double scale = 0.0;          // rad per count and sample (gyros only)
  double explained = 0.0;      // part of the sum of squares, 1: all
  std::vector<Matrix3> alike;  // other rotations that explain it within 2 %
  std::size_t seen = 0;        // turns or rests
  bool fits(const Matrix3& other) const;
  Matrix3 matrix() const { return sign * rotation; }
};

// Gyros against the gimbal's turns: C_vb = Rz(outer) Ry(inner). nullopt: nothing turned.
std::optional<AxisFit> gyros_by_gimbal(const Motion& motion, const std::vector<Turn>& turns, bool swapped);

// Accelerometers against the read-outs at rest: specific force is the same in v. The sign of all three is not seen.
std::optional<AxisFit> accelerometers_by_gimbal(const std::vector<Rest>& rests, bool swapped);

// Gyros against the accelerometers' turning: df = -omega x f. `rotation` takes gyro axes to accelerometer axes.
std::optional<AxisFit> gyros_by_gravity(const Motion& motion);

// The same from rest to rest, for turns by hand: the gyros' samples, added up to a rotation, take one direction of gravity into
// the next. SCALE is a first guess, rad per count and sample.
std::optional<AxisFit> gyros_from_rest_to_rest(const TriadColumns& gyro, const Motion& motion,
                                               const std::vector<Rest>& rests, double scale);

// omega . f / (|f| Omega) at rest, which is the sine of the latitude: gyros in rad per sample (axes and scale applied),
// accelerometers with their axes. RATE_HZ makes rad/s of it. nullopt: drowned in bias or noise.
struct EarthRate {
  double sine_of_latitude = 0.0;
  double sigma = 0.0;
};
std::optional<EarthRate> earth_rate(const std::vector<Rest>& rests, const Matrix3& gyro_axes, double rad_per_count_s,
                                    const Matrix3& accel_axes, bool has_gimbal, bool swapped);

}  // namespace selfcal::import
