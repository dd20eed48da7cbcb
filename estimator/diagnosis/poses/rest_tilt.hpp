// Whether what accelerometers show at rest is a tilt of the base: then the gyros turn by as much. Private to this folder.
//
//   a turn by a small angle theta changes the specific force f by -theta x f:   theta = (df x u) / g
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/diagnosis/poses/rest_blocks.hpp"

namespace selfcal::diagnosis {

// Takes the terms of accelerometers that are tilts of the base out of `rest`, and says of each that stays whether a tilt may have made it. Of a
// jump the gyros answer for themselves, in two blocks about it; what changes slowly is the base's where gyros and gravity agree in its course
// (noise/base_tilt.hpp). Nothing where the units are not known or an axis is missing.
void judge_tilt(const PoseInput& input, const std::vector<Pose>& poses, const RestBlocks& blocks, Rest& rest);

}  // namespace selfcal::diagnosis
