// Axes of a triad that are a signed permutation of the right ones.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {

// Measured axis i is sign[i] times true axis of[i].
struct AxisOrder {
  std::array<int, 3> of{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};

  Matrix3 matrix() const;  // measured = matrix * truth
  bool right() const { return *this == AxisOrder{}; }
  bool ordered() const { return of == AxisOrder{}.of; }
  int changed() const;  // axes that are not the right ones

  std::string words() const;  // "x gives y, z gives -z"
  // What makes them right: "negate y", "take x = y, y = -x".
  std::string mend() const;
  // "forward-right-down" and the like, where the axes are a usual set seen from b (forward, up, right); else empty.
  std::string name() const;

  bool operator==(const AxisOrder&) const = default;
};

// All 48, the right one first.
const std::vector<AxisOrder>& all_axis_orders();

}  // namespace selfcal::diagnosis
