// Gyros integrated between the stamps of an attitude. Private to this folder; equations (A1) to (A3): attitude.hpp.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "estimator/diagnosis/poses/attitude_knots.hpp"

namespace selfcal::diagnosis {

// Gyros as a function of time: cubics through the samples, with the slopes of their neighbours' chords (Catmull and Rom).
struct GyroTrack {
  std::vector<double> time_s;
  std::vector<Vector3> gyro;   // raw
  std::vector<Vector3> slope;  // raw per s
  // Slope of a line through all samples within 0.04 s, raw per s. Between two neighbours alone it would share their noise with the integral, and
  // the smoothing would be that of noise.
  std::vector<Vector3> wide_slope;
  std::vector<Vector3> integral;  // from the first sample on, raw s
  std::vector<bool> lost;         // between a sample and the one before: a gap, or an end of the range
};
GyroTrack track_of(const PoseInput& input);
// By straight lines; time clamped to the track.
Vector3 integral_at(const GyroTrack& track, double time_s);

struct AttitudeModel {
  Matrix3 W = Matrix3::Identity();  // omega_ib_m = W (g - bias), rad/s per raw unit: the inverse of M C_bm
  Eigen::MatrixXd seen;             // [3 x axes]: directions of g that turns reach; W is estimated there
  Vector3 bias = Vector3::Zero(), slope = Vector3::Zero();  // raw, raw per s, at and about the middle
  Eigen::MatrixXd walk;  // [3 x nodes], raw: what the bias wanders by, at equal distances over the log; 0 in the middle
  double begin_s = 0.0, node_s = 1.0, middle_s = 0.0;
  Vector3 earth = Vector3::Zero();  // Omega_r, rad/s
  double delay_s = 0.0, drift = 0.0;
  double smoothing =
      0.0;  // s^2; omega = W (g - smoothing d^2g/dt^2 - bias): half the second moment of what the gyros average over, less the attitude's

  struct At {
    Eigen::Index node = 0;  // and the next one
    double share = 0.0;     // of the next one
  };
  At walk_at(double time_s) const;
  Vector3 bias_at(double time_s) const;
  double true_time(double stamp_s) const { return stamp_s - delay_s - drift * (stamp_s - middle_s); }
};

// From one stamp to the next: what the attitude turned more than the gyros, in r, and derivatives of what the gyros turned.
struct AttitudeRow {
  std::size_t knot = 0;  // at its end
  bool begins = false;   // the stamp before it belongs to no row, or to another piece
  bool held = false;
  double length_s = 0.0, stamp_s = 0.0;  // from stamp to stamp; of its end
  double time_s = 0.0;                   // true, of its middle
  Vector3 more;                          // rad
  Eigen::Matrix<double, 3, 9> by_W;      // columns: raw axis, then m axis
  Matrix3 by_bias;
  Vector3 by_smoothing;
  Vector3 rate_before, rate;  // omega_rm in r at both ends, rad/s
};
// Q: of the knots. Rows of pieces that the log holds whole.
std::vector<AttitudeRow> integrate(const GyroTrack& track, const Knots& knots,
                                   const std::vector<Eigen::Quaterniond>& q_rm, const AttitudeModel& model);

// |result| <= pi; q and -q are the same.
Vector3 rotation_vector(const Eigen::Quaterniond& q);

}  // namespace selfcal::diagnosis
