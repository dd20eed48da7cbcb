// What the gyros must be for gravity to be carried from pose to pose: their unit, and which axis is which. Private to this folder.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct GyroReading {
  Matrix3 axes = Matrix3::Identity();  // rate in the accelerometers' axes = axes * reading
  double unit = 1.0;                   // rad/s a raw unit
};

// The reading with which most turns end where gravity is; none where no reading does, or several do.
std::optional<GyroReading> read_gyros_by_turns(const PoseInput& input, const std::vector<Pose>& poses,
                                               const std::vector<std::size_t>& turns);

// The input with the unit of its gyros by the turns, where nobody says it: into `gyro_raw_unit`, and `gyros_contradict` where their axes are not the
// accelerometers'. Counts that are rad/s within 30 % are rad/s.
PoseInput with_unit_by_turns(const PoseInput& input, const std::vector<Pose>& poses,
                             const std::vector<std::size_t>& turns, PoseDiagnosis& d);

// What contradicts what is said of them: another unit, or other axes; empty: nothing.
std::string contradiction(const PoseInput& input, const GyroReading& reading);

// What is to be said of turns that end `off` (rad) from where gravity is, and that no other axes or unit mend: the gyros do not turn while gravity
// does, or they stand aslant in the accelerometers; empty: too few turns to say it.
std::string turns_elsewhere(const PoseInput& input, const std::vector<Pose>& poses,
                            const std::vector<std::size_t>& turns, double off);

}  // namespace selfcal::diagnosis
