// What a recording can be held against: the position at rest, or no more than gravity in poses and angle read-outs.
#pragma once

#include <string>

#include "estimator/models/imu_data.hpp"

namespace selfcal::diagnosis {

struct PositionReference {
  bool usable = true;
  std::string why_not;  // a sentence, with the number that shows it
};

// The position at rest calibrates what the Earth's rate aligns. That needs gyros whose white noise leaves it visible over the
// whole recording (to a twentieth), and an IMU that turns in its place: where gravity turns in the sensor and no read-out
// ever moves, a hand has moved it.
PositionReference position_reference(const ImuData& data);

}  // namespace selfcal::diagnosis
