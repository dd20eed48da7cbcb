// A bias of the accelerometers that is another from one pose on. Private to this folder.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// Of the steps between two poses, three and more on either side, that which explains |f| - g best, where chance makes it by less than
// `log_limit` and no effect, of which the likeliest has `log_p_of_effect`, explains the poses within a hundredth as well. Where
// it is holds each step that is not a hundred times less likely than the best one. A step that chance makes in less than a tenth of cases moves sigma of the nine as an effect does, told or not.
std::optional<AccelJump> find_accel_jump(const std::vector<Pose>& poses, double log_limit, double log_p_of_effect,
                                         AccelModel& model);

}  // namespace selfcal::diagnosis
