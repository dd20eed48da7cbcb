// Diagnosis of sensors without gimbal read-out and without a visible Earth rate, turned by hand between static poses.
//
// Nothing is known of attitude but what gravity tells: specific force has the size of gravity in every pose; gyros in a
// pose read their bias and what the pose does to it; and gyros integrated from one pose to the next must carry the
// direction of gravity along. Noise is what the poses scatter by, so tests are F tests. Effects are the catalogue's.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"
#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {

struct PoseInput {
  std::vector<double> time_s;                      // increasing
  std::vector<std::array<double, 3>> gyro, accel;  // raw, any unit
  double gyro_unit = 1.0;                          // nominal rad/s per raw unit
  double gravity = 9.80665;                        // m/s^2, or 1 for an answer in g
};

struct PoseEffect {
  const Effect* effect = nullptr;
  std::vector<std::string> parameters;   // names
  std::vector<double> value, sigma;      // raw gyro or accelerometer units (per g, ...)
  double log_p = 0.0;                    // F test, corrected for axes, effects and constants tried
  std::array<double, 3> held_out_rms{};  // of poses left out in turn, raw units, with this and what was named before
};

struct PoseDiagnosis {
  int poses = 0;
  double static_seconds = 0.0;
  // Accelerometers: bias, scale, misalignment fitted to |f| = g.
  double accel_rms_g = 0.0, accel_held_out_rms_g = 0.0;
  bool accel_adequate = false;
  std::vector<PoseEffect> accel_tried;  // best first
  // Gyros in the poses.
  std::array<double, 3> gyro_held_out_rms{};  // bias alone, raw units
  std::array<double, 3> gyro_white_rms{};     // what white noise would leave of a pose's mean
  std::vector<PoseEffect> gyro_tried;         // each alone, best first
  std::vector<PoseEffect> gyro_named;         // forward selection
  // Direction of gravity carried from pose to pose: rms, rad; scale and misalignment of the gyros fitted.
  double direction_before = 0.0, direction_after = 0.0;
  double direction_before_held_out = 0.0, direction_after_held_out = 0.0;  // rotation and its poses left out
  std::vector<std::string> invisible;                                      // in words
  std::string failure;                                                     // empty: done
};

PoseDiagnosis diagnose_poses(const PoseInput& input, double false_alarm_rate);

}  // namespace selfcal::diagnosis
