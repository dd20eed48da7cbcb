// Angles that are read, and what they make of each other.
#pragma once

#include <vector>

#include "estimator/geometry/rotation.hpp"

namespace selfcal {

// The same angle from minus to plus half a turn, rad.
double within_half_a_turn(double angle);

struct GimbalAngles {
  double outer = 0.0, inner = 0.0;  // rad
};
// Inverse of gimbal_matrix, also of a matrix that is nearly one.
GimbalAngles gimbal_angles(const Matrix3& C_vb);

// Read-outs that begin again after a full turn as one angle, rad: none turns by more than half a turn from the one before. What never
// begins again keeps its bits.
std::vector<double> unwrapped(std::vector<double> angle);

}  // namespace selfcal
