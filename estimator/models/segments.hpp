// Dwells and rotations of a recording.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/models/imu_data.hpp"

namespace selfcal {

struct Segment {
  bool rotation = false;
  std::size_t first = 0, last = 0;  // samples [first, last)
  double start_s = 0.0, end_s = 0.0;
  double outer = 0.0, inner = 0.0;  // mean gimbal read-out of a dwell, rad; 0 where there is none
};

// Cuts the recording where the gimbal starts and stops. The gimbal read-outs decide where present; else the gyros,
// with a threshold of a quarter of the fastest turn (sway of a moored base is slower than that). Stretches shorter
// than 1 s are joined to their neighbour.
std::vector<Segment> find_segments(const ImuData& data);

// The same without the samples that hold no observation: a dwell with such in its middle becomes two.
std::vector<Segment> observed(const std::vector<Segment>& segments, const ImuData& data);

}  // namespace selfcal
