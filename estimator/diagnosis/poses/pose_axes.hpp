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

// What contradicts what is said of them: another unit, or other axes; empty: nothing.
std::string contradiction(const PoseInput& input, const GyroReading& reading);

}  // namespace selfcal::diagnosis
