// What a sensor that stands says of itself: a log in one pose, or in fewer than the six that calibrate.
//
// Gravity and the Earth's rate stand still with it, so that what moves is the sensor, the base, or noise. Means of blocks are held
// beside slow noise (rest_noise.hpp), and equations of time and of a measured temperature are asked beside it (rest_drift.hpp).
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"
#include "estimator/diagnosis/noise/base_tilt.hpp"

namespace selfcal::diagnosis {

struct PoseInput;
struct Pose;
struct PoseDiagnosis;

// What a coefficient multiplies. The catalogue's equation where it holds one.
struct RestEquation {
  const Effect* effect = nullptr;  // null: temperature squared, rate of temperature, and a jump
  std::string id;
  std::string unit;             // of the coefficient where the sensors' units are SI
  double si_per_unit = 1.0;     // rad/s or m/s^2, per s and degC, in one `unit`
  std::string raw_per;          // where they are not: raw units per this; empty: raw units
  double raw_per_factor = 1.0;  // raw units per s and degC in one raw unit per `raw_per`
  bool of_temperature = false;  // reads the channel
  bool jumps = false;           // a bias that is another from a time on
};

struct RestAmplitude {
  RestEquation equation;
  double value = 0.0, sigma = 0.0;              // raw units, per s and degC; all of a warm-up
  double constant = NAN, constant_sigma = NAN;  // time constant, or time of a jump, s; NaN: none
};

struct RestTerm {
  RestAmplitude found;
  double log_p = 0.0;                  // corrected for axes, equations and time constants
  double share = 0.0;                  // of the square of the blocks' means about their mean
  std::vector<RestAmplitude> as_well;  // each in its place: explain the log as well
  // Of an accelerometer: whether the base may have tilted instead (rest_tilt.hpp). One that was seen to is no term.
  enum class Tilt { none, open, excluded, seen } tilt = Tilt::none;
  double tilt_angle = 0.0;         // rad, of a jump
  std::vector<std::string> twins;  // ids of equations that are this one as long as nothing turns
};

// The base tilted at once, as gravity and gyros both show.
struct RestTilt {
  double time_s = 0.0, angle = 0.0;  // rad, by gravity
  double share = 0.0, sigma = 0.0;   // of it, by the gyros
};

struct RestAxis {
  bool gyro = true;
  int axis = 0;
  double mean = 0.0, mean_sigma = 0.0;  // raw, in the pose that stands longest, at its middle; slow noise included
  double white_asd = 0.0;               // raw sqrt(s)
  double instability = 0.0;             // least Allan deviation, raw
  double instability_tau_s = 0.0;       // where it is
  bool instability_is_bound = false;    // it falls to the longest time there is
  double walk = NAN, walk_sigma = NAN;  // raw / sqrt(s); NaN: not seen
  double quantum = 0.0;                 // raw; 0: finer than the noise
  double swing = 0.0, swing_hz = 0.0;   // amplitude, raw, of a line or a motion; 0: none that white noise does not make
  double rms = 0.0, rms_left = 0.0;     // of the blocks' means, without the equations and beside them
  std::vector<RestTerm> terms;
};

struct Rest {
  bool si = false;  // raw units are rad/s and m/s^2
  int blocks = 0;
  double block_s = 0.0;
  bool drift_tested = false;               // blocks enough
  std::optional<double> coldest, warmest;  // degC, of the blocks; of a channel that moves by more than its noise
  bool has_channel = false;
  std::vector<RestAxis> axes;
  std::vector<RestTilt> tilts;
  std::optional<BaseTilt> base_tilt;  // slowly, likewise
};

// nullopt: less than 5 blocks rest. `noise` of both triads in `d` is used.
std::optional<Rest> judge_rest(const PoseInput& input, const std::vector<Pose>& poses, double alpha,
                               const PoseDiagnosis& d);
// What stays undetermined, in five lines at most.
std::vector<std::string> undetermined_at_rest(const Rest& rest, const PoseDiagnosis& d);

}  // namespace selfcal::diagnosis
