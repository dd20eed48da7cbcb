// Static poses of a hand-held recording, their means, and the accelerometers' calibration. Private to this folder.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {

struct Pose {
  std::size_t first = 0, last = 0;  // samples
  double middle_s = 0.0;
  Vector3 gyro, accel;  // means, raw
  Vector3 gyro_white;   // sigma of the mean by white noise, raw
  Vector3 u;            // calibrated, g
};

// Stretches of 1 s and more in which both triads scatter by less than three times what the quietest tenth does.
std::vector<Pose> find_poses(const PoseInput& input);

// u = T (a - b), T upper triangular.
struct AccelModel {
  Matrix3 T = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();
  Eigen::VectorXd residual;  // |u| - 1 of the poses
  Eigen::MatrixXd jacobian;  // of the residual, [poses x 9]
  Vector3 direction(const Vector3& raw) const { return T * (raw - bias); }
};
AccelModel fit_accelerometers(const std::vector<Pose>& poses);

// Turns between poses: direction of gravity carried by the gyros, w = S (raw - bias - G u) times the unit.
struct GyroModel {
  Matrix3 S = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();  // raw
  Matrix3 G = Matrix3::Zero();     // raw per g
};
// u at the beginning of pose k+1, carried there from pose k, less the accelerometers' u.
Vector3 direction_error(const PoseInput& input, const Pose& from, const Pose& to, const GyroModel& model);
// Fits S to the turns whose number is not `without`.
void fit_turns(const PoseInput& input, const std::vector<Pose>& poses, std::size_t without, GyroModel& model);

}  // namespace selfcal::diagnosis
