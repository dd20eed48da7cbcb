// What is as quiet as a pose and none: a vehicle that drives, a centrifuge, acceleration without gravity. Private to this folder.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// Whether the sensor moves in a stretch: means of a quarter of a second scatter by more than a degree a second or 0.05 g, which no bias does.
// Gyros in raw units are not asked.
bool moves(const PoseInput& input, const Pose& stretch);

// Forces of all stretches, g, where the gyros rest in nearly all of them and a third and more read another force than 1 g: what is wrong
// there is the accelerometers' zero. Empty: no.
std::vector<double> forces_of_another_zero(const PoseInput& input, const std::vector<Pose>& stretches);

// Takes out stretches in which the accelerometers read another force than gravity by more than any bias, where their unit is known: steady
// acceleration. Returns what they read, in g.
std::vector<double> drop_other_forces(const PoseInput& input, std::vector<Pose>& stretches);

// Samples that lack: an interval of more than half a second, and of ten usual ones, ends at these.
std::vector<std::size_t> find_gaps(const PoseInput& input);

// Why gravity does not stand in these poses of accelerometers in a unit that nobody says, in words, where it does not: what they read
// while the sensor moves is many times what the fitted model takes for gravity. Empty: it may.
std::string lacks_gravity(const PoseInput& input, const std::vector<Pose>& poses, const AccelModel& model);

// Why gravity is not what calibrated poses stand in, in words: what `lacks_gravity` says, or forces of all sizes at rest. No parameter of the
// accelerometers follows from them then. Empty: it is.
std::string not_gravity(const PoseInput& input, const std::vector<Pose>& poses, const AccelModel& model);

}  // namespace selfcal::diagnosis
