#include "estimator/geometry/angles.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace selfcal {

double within_half_a_turn(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

GimbalAngles gimbal_angles(const Matrix3& C_vb) {
  return {std::atan2(-C_vb(0, 1), C_vb(1, 1)), std::atan2(-C_vb(2, 0), C_vb(2, 2))};
}

std::vector<double> unwrapped(std::vector<double> angle) {
  constexpr double turn = 2.0 * std::numbers::pi;
  double whole = 0.0;
  for (std::size_t i = 1; i < angle.size(); ++i) {
    whole -= turn * std::round((angle[i] + whole - angle[i - 1]) / turn);
    angle[i] += whole;
  }
  return angle;
}

}  // namespace selfcal
