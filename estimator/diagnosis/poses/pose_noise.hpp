// The Allan deviation of what stands in static poses. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// Overlapping, pooled over the poses' undisturbed stretches: each has its own mean, so that what differs between poses does not count.
// At 1, 2, 4 ... s, up to a third of the longest stretch.
std::vector<RestNoise> noise_at_rest(const PoseInput& input, const std::vector<std::array<double, 3>>& series,
                                     const std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
