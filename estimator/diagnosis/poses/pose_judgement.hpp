// What the poses say of either triad. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// Effects of the accelerometers in |f| - g.
void judge_accelerometers(AccelModel& model, const std::vector<Pose>& poses, double duration_s, bool has_temperature,
                          double alpha, PoseDiagnosis& d);
// Names of the gyros' effects, one after the other, and what stands in for one another.
void judge_gyros(const PoseInput& input, const std::vector<Pose>& poses, double duration_s, bool has_temperature,
                 double alpha, PoseDiagnosis& d);
// What |f| does after each turn, less what `thermal` makes of the temperature meanwhile; nullopt: nothing beyond chance.
std::optional<Settling> find_settling(const PoseInput& input, const std::vector<Pose>& poses, const AccelModel& model,
                                      const std::vector<PoseEffect>& thermal, double alpha);
// Takes it out of the poses' means.
void take_out(const Settling& settling, const PoseInput& input, const AccelModel& model, std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
