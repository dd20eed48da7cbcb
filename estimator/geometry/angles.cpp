#include "estimator/geometry/angles.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace selfcal {

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
