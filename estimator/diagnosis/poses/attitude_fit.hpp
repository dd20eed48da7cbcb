// Gauss-Newton of the gyros against an attitude. Private to this folder; equations (A1) to (A4): attitude.hpp.
//
// The bias is a constant, a slope, and a random walk with nodes over the log, pinned to zero in the middle; its density is marginalised over a
// grid by its likelihood, for the greatest one alone would understate sigma. Sigma is enlarged where the scores of 40 parts of the log
// scatter by more than they should at 0.1 %: noise that is not as (A3) has it.
#pragma once

#include "estimator/diagnosis/poses/attitude_noise.hpp"
#include "estimator/diagnosis/poses/attitude_start.hpp"

namespace selfcal::diagnosis {

// Columns of the parameters. W: 3 per seen direction.
struct AttitudeLayout {
  Eigen::Index axes = 3, nodes = 0;
  Eigen::Index W() const { return 0; }
  Eigen::Index bias() const { return 3 * axes; }
  Eigen::Index slope() const { return bias() + 3; }
  Eigen::Index earth() const { return slope() + 3; }
  Eigen::Index delay() const { return earth() + 3; }
  Eigen::Index drift() const { return delay() + 1; }
  Eigen::Index smoothing() const { return drift() + 1; }
  Eigen::Index walk() const { return smoothing() + 1; }
  Eigen::Index size() const { return walk() + 3 * (nodes - 1); }  // the middle node is zero
};

struct AttitudeFit {
  AttitudeModel model;
  AttitudeLayout layout;
  AttitudeNoise noise;
  Eigen::MatrixXd covariance;          // of all before the walk
  Vector3 mean_bias, mean_bias_sigma;  // raw, over the log
  double walk_psd = 0.0;               // raw^2/s, of the greatest likelihood
  double misfit = 1.0;                 // what a sigma was enlarged by at most
  std::vector<AttitudeRow> rows;
  Used used;
  std::size_t left_out = 0;  // values that jump
  int held = 0;
  double held_s = 0.0;
  std::vector<Eigen::Quaterniond> q_rm;  // of the knots
};

AttitudeFit fit_attitude(const GyroTrack& track, const ReferenceAttitude& attitude, const Knots& knots,
                         const AttitudeStart& start);

}  // namespace selfcal::diagnosis
