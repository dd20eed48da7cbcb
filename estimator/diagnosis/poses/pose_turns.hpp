// Turns between poses: the direction of gravity carried by the gyros. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// w = S (raw - bias - G u) times the unit.
struct GyroModel {
  Matrix3 S = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();  // raw
  Matrix3 G = Matrix3::Zero();     // raw per g
  bool drifts = false;  // then what the poses at both ends of a turn read besides, straight between them, is bias too
};

// Numbers of the poses behind which a turn begins that holds no sample at the end of the gyros' range (d.clipped) and none that was
// left out.
std::vector<std::size_t> usable_turns(const PoseInput& input, const std::vector<Pose>& poses, const PoseDiagnosis& d);

// Direction of gravity before and after what is named, fitted and held out, into `d`; `turns`: those that are usable. Sigma of
// the parameters holds what the poses leave open of the accelerometers' misalignments.
void judge_turns(const PoseInput& input, const std::vector<Pose>& poses, const std::vector<std::size_t>& turns,
                 const AccelModel& accel, bool linear, PoseDiagnosis& d);

}  // namespace selfcal::diagnosis
