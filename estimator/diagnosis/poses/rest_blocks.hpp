// Means of a log that stands over blocks of equal length. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/diagnosis/poses/rest_noise.hpp"

namespace selfcal::diagnosis {

// Means over blocks of equal length, one row each.
struct RestBlocks {
  BlockTimes times;
  std::vector<std::size_t> pose;  // whose block it is; of several that are one stand but for gaps of the log the first
  std::size_t longest = 0;        // the pose that stands longest
  std::size_t stand = 0;          // `pose` of its blocks
  Eigen::MatrixXd gyro, accel;    // [blocks x 3], raw
  Eigen::VectorXd temperature;    // degC; empty: no channel, or none that moves by more than its noise
  double duration_s = 0.0;        // of the log
  Eigen::Index rows() const { return gyro.rows(); }
};
RestBlocks rest_blocks(const PoseInput& input, const std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
