// Columns that hold an attitude, by their names: which of a quaternion, a rotation matrix or three angles each is, and who computed it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace selfcal::import {

// quaternion: w x y z. matrix: row by row. angles: roll, pitch, yaw.
enum class AttitudeForm { quaternion, matrix, angles };

// Who computed it, as far as a name says so.
enum class AttitudeClaim { nothing, reference, computed };

struct AttitudeColumns {
  AttitudeForm form = AttitudeForm::quaternion;
  std::vector<std::size_t> columns;  // 4, 9 or 3, from 0
  bool order_known = true;           // of a quaternion: no name says which is w, and they are as they stand
  std::string unit;                  // of angles: "deg", "rad"; empty: none is said
  AttitudeClaim claim = AttitudeClaim::nothing;
};

// All that the names show, as they stand: `qw qx qy qz`, `quat0` to `quat3`, `orientation.w`, `q_RS_w []`, `R11` to `R33`, `ref_roll` ...
std::vector<AttitudeColumns> attitudes_by_name(const std::vector<std::string>& names,
                                               const std::vector<std::string>& units);

}  // namespace selfcal::import
