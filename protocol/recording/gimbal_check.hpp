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

// Whether nothing is wrong but a clock and a bias: with one lag of the read-outs, up to 1.5 s either way, that changes evenly by at most 1 s from
// the first row to the last (angles as commanded, on a clock of their own), and less what the gyros drift by while the read-outs stand
// (degrees a second of a MEMS gyro), no window contradicts by more than a tolerance found as above. Windows in which the gyros turn
// by more than half a round, and the read-outs go round, say nothing: angles are known but for whole rounds. Reversed or exchanged axes, another unit and
// a read-out that stands are no lag.
bool lags_alone(const Recording& recording);

}  // namespace selfcal
