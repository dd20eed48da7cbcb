// What of the accelerometers follows a measured temperature from pose to pose. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// Mean temperatures of the poses, less their mean, into the poses; false, and zero, where there is no channel or it does not move: by
// 0.2 degC rms between poses, and twice as much as inside the quieter half of them.
bool take_temperatures(const PoseInput& input, std::vector<Pose>& poses);

// Effects with a measured temperature that |f| - g of the poses shows, strongest first, the last one fitted beside the others; values and
// sigma SI. Two coefficients of freedom are left at least. Asked beside a random walk: a temperature goes with time.
std::vector<PoseEffect> name_thermal(const AccelModel& model, const std::vector<Pose>& poses, double duration_s,
                                     double alpha);

// Once more on what they leave in `poses`, from which they were taken out: adds to their values, sigma anew. Returns what was added.
std::vector<PoseEffect> refine_thermal(const AccelModel& model, const std::vector<Pose>& poses, double duration_s,
                                       std::vector<PoseEffect>& named);

// What they add to specific force at a pose, in g.
Vector3 thermal_force(const std::vector<PoseEffect>& named, const Pose& pose, double duration_s);

// Takes it out of the poses' means.
void take_out(const std::vector<PoseEffect>& named, const AccelModel& model, double duration_s,
              std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
