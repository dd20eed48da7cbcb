// Accelerometers whose bias goes on from pose to pose, where few residuals are left to show it. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// The halves of the poses tell how fast each axis drifts: a rate that is constant or changes evenly. Where chance makes as much in less than a
// tenth of cases, sigma of the nine holds by how much that moves them, and a bias that it is another at the end than at the begin.
void hold_drift(const std::vector<Pose>& poses, AccelModel& model);

}  // namespace selfcal::diagnosis
