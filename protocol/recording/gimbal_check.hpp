// The gimbal read-outs against the gyros: both saw the same turns.
#pragma once

#include <cstddef>
#include <optional>

#include "protocol/recording/recording.hpp"

namespace selfcal {

// The window in which the two disagree most, if that is more than they may.
struct GimbalContradiction {
  std::size_t first_row = 0;
  std::size_t last_row = 0;
  double outer_turn_deg = 0.0;  // of the read-out, first row to last row, within half a turn
  double inner_turn_deg = 0.0;
  double gyro_turn_deg = 0.0;     // angle that the gyros integrate to
  double disagreement_deg = 0.0;  // angle of the rotation between the two
  double tolerance_deg = 0.0;
};

// Windows of 4 s, half overlapping (a move of any schedule fills at least a part of one). In each, the gyros give
// C_ib(t0)^T C_ib(t1) and the read-outs C_vb(t0)^T C_vb(t1); they differ by the vehicle's own rotation and the
// Earth's. The tolerance is coarse on purpose, for the sensors here are not calibrated and the base may lie moored:
// 2 deg (twice the 1 deg to which a gimbal need be accurate) and six times what a quiet window of this recording
// shows (lower quartile: most windows are dwells, and a sway's peak is below six times its lower quartile), at most
// 20 deg. What it is for is far larger: swapped or reversed axes, degrees for radians, a read-out that stands still.
std::optional<GimbalContradiction> find_gimbal_contradiction(const Recording& recording);

}  // namespace selfcal
