// The attitude that something else measured, as a reference for gyros and accelerometers: an optical tracker, a robot's arm, a reference INS.
//
// Frames: b = IMU, m = the body whose attitude is measured, fixed to b by an unknown rotation C_bm; r = the frame that it is measured in,
// which turns with the Earth. C_rm takes m to r. Equations:
//   (A1) g = M (C_bm omega_rm + C_br Omega_r) + bias(t) + white noise      Omega_r: the Earth's rate in r, three unknowns
//   (A2) C_rm as stamped s was true at s - delay - drift (s - middle)
//   (A3) z_k = sum over the intervals of C_rm log(what the gyros turned^T, what the attitude turned): a random walk that the gyros' white
//        noise makes, plus the attitude's own error at s_k, white or of first order. Both are isotropic, so that one scalar filter
//        whitens the three axes of r, and neighbouring intervals share their error at the stamp between them.
//   (A4) what gyros and attitude average over, to the second order: g - smoothing d^2g/dt^2 in place of g
//   (A5) f = K C_bm C_mr up_r g + bias in poses; up_r: two unknown angles
// Observable: M C_bm and K C_bm, nine elements each, if the turns and gravity reach three axes. C_bm is nobody's: without (A5) it is chosen so
// that M is symmetric (six of nine remain), with it so that K is upper triangular as in the poses, and all nine of M are seen against it.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/pose_parameter.hpp"
#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {

struct PoseInput;
struct Pose;

// What the file's numbers mean if its names are read so.
struct AttitudeReading {
  std::string words;                     // "quaternions x y z w, reference to body"
  std::vector<Eigen::Quaterniond> q_rm;  // of unit length; NaN: no attitude
};

struct ReferenceAttitude {
  std::vector<double> time_s;             // increasing; on the log's clock as far as the file says
  std::vector<AttitudeReading> readings;  // all that the names leave open, the likeliest first
  bool in_rows_of_log = false;            // a value may be the latest one, held
};

// A deviation of the gyros' residual from the attitude in rest, over their own noise: 1 of a reference, 0 of an attitude that was
// computed from these gyros, which has their noise in it.
struct Independence {
  double value = 0.0, sigma = 0.0;
  bool derived = false;  // from these gyros, beyond doubt
  bool shown = false;    // that it is not, beyond doubt
};

struct GravityByAttitude {
  int poses = 0;
  std::vector<PoseParameter> parameters;        // K: scale factors, upper misalignments (1); biases (raw)
  double rms = 0.0;                             // of the poses' means, m/s^2 nominal
  double lean_deg = 0.0, lean_sigma_deg = 0.0;  // of the axis of r that is nearest to the vertical
  std::string lean_axis;
};

// What the gyros read, nominal, of a turn about an axis.
struct TurnedAxis {
  Vector3 along;  // of unit length, in the gyros' axes
  double gain = 0.0, sigma = 0.0;
};

struct ByAttitude {
  std::string failure;  // a line; empty: done, and what follows is filled
  std::string reading;  // as it was read
  bool read_by_data = false;
  std::vector<std::string> read_as_well;  // readings that the turns do not tell from it
  std::size_t samples = 0;                // of the attitude that are used
  double seconds = 0.0, interval_s = 0.0;
  std::size_t without = 0, left_out = 0;  // samples: that hold no attitude; that jump, or that the gyros contradict
  int held = 0;                           // stretches in which the attitude stands and the gyros turn
  double held_s = 0.0;
  int pieces = 0;                    // stretches without a gap
  Vector3 turned_deg;                // rms rate times duration, about the main axes of the turns, largest first
  int axes = 0;                      // of those, how many are turned about enough
  std::vector<TurnedAxis> gains;     // where these are fewer than three
  double raw_per_si = 1.0;           // gyros: raw units per rad/s that the parameters are relative to
  bool by_accelerometers = false;    // b is the accelerometers' frame; else the one in which M is symmetric
  std::vector<PoseParameter> gyros;  // M: scale factors, misalignments; 1
  Vector3 bias, bias_sigma;          // raw, mean over the recording
  Vector3 slope, slope_sigma;        // raw per s
  double walk = 0.0;                 // raw per sqrt(s); the likeliest
  double gyro_asd = 0.0;             // white noise, raw per sqrt(Hz)
  double delay_s = 0.0, delay_sigma_s = 0.0, drift_ppm = 0.0, drift_sigma_ppm = 0.0;  // (A2), of the middle
  bool delay_seen = false;
  double smoothing_s2 = 0.0, smoothing_sigma_s2 = 0.0;  // (A4)
  double noise_rad = 0.0, noise_time_s = 0.0;           // of the attitude, an axis; 0: white
  Vector3 earth, earth_sigma;                           // in r, rad/s
  Vector3 mount, mount_sigma;                           // rotation vector of C_bm, rad
  double misfit = 1.0;                                  // what sigma was enlarged by at most
  Independence independence;
  std::optional<GravityByAttitude> gravity;
  std::vector<std::string> invisible;
};

// ATTITUDE against the log; POSES: where it stands. Failure, in a line: no overlap, no turn, turns that the gyros do not show.
ByAttitude judge_attitude(const PoseInput& input, const ReferenceAttitude& attitude, const std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
