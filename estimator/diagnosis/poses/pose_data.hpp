// Static poses of a recording, their means, and the accelerometers' calibration. Private to this folder.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "estimator/diagnosis/poses/pose_stuck.hpp"
#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {

struct Pose {
  std::size_t first = 0, last = 0;                         // samples
  std::ptrdiff_t part = 0;                                 // gaps of the log before it
  std::vector<std::pair<std::size_t, std::size_t>> quiet;  // of them those without a disturbance
  double middle_s = 0.0, length_s = 0.0;
  double temperature = 0.0;         // mean, less that of all poses, degC; zero: no channel that moves
  Vector3 gyro, accel;              // means, raw
  Vector3 gyro_white, accel_white;  // sigma of the mean by white noise, raw
  Vector3 gyro_half, accel_half;    // half the difference between the means of both halves, raw
  Vector3 gyro_hidden = Vector3::Zero(), accel_hidden = Vector3::Zero();  // sigma of the mean by the quantum, raw
  Vector3 u = Vector3::Zero();                                            // calibrated, g
};

// Whether a unit of the gyros is said, be it rad/s.
inline bool knows_gyro_unit(const PoseInput& input) { return input.gyros_si || input.gyro_unit != 1.0; }

// Mean over the log, Hz.
inline double sample_rate(const PoseInput& input) {
  return static_cast<double>(input.time_s.size() - 1) / (input.time_s.back() - input.time_s.front());
}

Vector3 at(const std::vector<std::array<double, 3>>& series, std::size_t i);

// The median of each axis; there is one vector at least.
Vector3 median_of_axes(const std::vector<Vector3>& all);

// Variance of what the gyros turn between two poses, raw^2 s^2: their white noise meanwhile, and that of the bias by both.
Vector3 variance_of_turn(const PoseInput& input, const Pose& from, const Pose& to);

// Gaps, stretches in which an axis is stuck, in which the accelerometers give zero, which gravity never does, or all six axes one value for
// half a second.
std::vector<LeftOut> find_left_out(const PoseInput& input, const std::vector<StuckAxis>& stuck);

// Poses by the motion: stretches of 1 s and more in which both triads scatter little, put together where neither gravity nor
// the gyros show a turn between them, and without those in which the sensor turns steadily. None holds what is left out.
struct FoundPoses {
  std::vector<Pose> poses;
  int steady_turns = 0;              // stretches as quiet as a pose that turn
  int moving = 0;                    // that move
  std::vector<double> other_forces;  // that read another force than gravity, g
  std::vector<double>
      zero_elsewhere;  // forces at rest, g, where a third and more are not gravity's though the gyros rest in them
};
FoundPoses find_poses(const PoseInput& input, const std::vector<LeftOut>& left_out);

// Axes that stand at the end of their range, which no other value approaches as often.
std::vector<Clipping> find_clipping(const PoseInput& input);

// Whether a gyro stands at the end of its range in a sample of [first, last).
bool gyros_clip(const PoseInput& input, const std::vector<Clipping>& clipped, std::size_t first, std::size_t last);

// Takes out the poses in which an accelerometer stands at the end of its range; how many those are.
int drop_clipped(const PoseInput& input, const std::vector<Clipping>& clipped, std::vector<Pose>& poses);

constexpr double misalignment_before = 0.03;  // rad, sigma of what an accelerometer's is before

// u = T (a - b), T upper triangular.
struct AccelModel {
  Matrix3 T = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();
  Eigen::VectorXd weight;    // of the poses, 1 for one as usual: a mean over a second counts less than one over twenty
  Eigen::VectorXd residual;  // |u| - 1 of the poses, times weight
  Eigen::MatrixXd jacobian;  // of the residual, [poses x 9]: bias, then T's xx yy zz xy xz yz
  Eigen::Matrix<double, 9, 1>
      sigma;  // of the nine: noise, as few residuals tell it, and what was assumed before together
  Eigen::Matrix<double, 9, 1> before;  // sigma of what is assumed before
  Eigen::Array<bool, 9, 1> held =
      Eigen::Array<bool, 9, 1>::Constant(false);  // left as assumed: gravity does not reach them
  Eigen::Matrix<double, 9, 1> open;  // sigma by which each is not known: of one that is held what it was before
  double raw_per_g = 1.0;
  bool nominal = false;        // whether the unit is known: else raw_per_g is a guess, and scale is raw units per g
  double gravity_sigma = 0.0;  // of gravity at the place, in parts of it: that of all three scale factors together
  double free = 0.0;           // degrees of freedom that the residuals have left
  double noise_of_means =
      0.0;  // of |u|, by the halves of the poses: slow noise included, and nothing that differs from pose to pose
  Vector3 direction(const Vector3& raw) const { return T * (raw - bias); }
  AccelModel moved_by(Eigen::Index parameter, double step) const;  // one of the nine
};
// With what any accelerometer is before: misaligned by 0.03, its scale and bias within 0.1 and 0.2 g of the nominal ones.
AccelModel fit_accelerometers(const PoseInput& input, const std::vector<Pose>& poses);
std::vector<PoseParameter> parameters_of(const AccelModel& model);
// The largest angle between directions of gravity in the sensor, of calibrated poses, deg.
double gravity_span_deg(const std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
