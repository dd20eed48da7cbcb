// Diagnosis of sensors without a visible Earth rate, turned by hand or by a table between static poses.
//
// Three references. Gravity: specific force has its size in every pose; gyros in a pose read their bias and what the pose does
// to it; gyros integrated from one pose to the next must carry its direction along. Angle read-outs, where there are any:
// what the gyros make of a turn, and how gravity turns in the sensor. An attitude that something else measured (attitude.hpp).
// Noise is what the poses scatter by, so that tests are F tests, and effects of the pose are tested beside a random walk of the
// reading. Effects are the catalogue's.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"
#include "estimator/diagnosis/poses/attitude.hpp"
#include "estimator/diagnosis/poses/dividing_head.hpp"
#include "estimator/diagnosis/poses/pose_parameter.hpp"
#include "estimator/diagnosis/poses/rest.hpp"
#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {

// What a log holds.
enum class Sensors { both, gyros, accelerometers };

struct PoseInput {
  std::vector<double> time_s;  // increasing
  std::vector<std::array<double, 3>> gyro,
      accel;  // raw, any unit; zero throughout of a triad that the log does not hold
  Sensors sensors = Sensors::both;
  std::array<bool, 3> gyro_axes{true, true, true};  // of gyros alone: which axes the log holds; others are zero
  bool gyros_si = true;                             // rad/s
  double gyro_unit = 1.0;                           // nominal rad/s per raw unit
  double accel_unit = 0.0;                          // nominal m/s^2 per raw unit; 0: not known
  bool accel_zero_known =
      true;                    // false: readings are about another zero, as of a sensor that was set to zero in a pose
  double gravity = 9.80665;    // m/s^2 where it was recorded
  double gravity_sigma = 0.0;  // of it, where nobody says the place
  std::optional<double> latitude;     // rad where it was recorded; none: not known
  std::vector<double> outer, inner;   // angle read-outs, rad, of any whole turns; empty: none
  std::vector<double> temperature_c;  // empty: no channel
  std::optional<ReferenceAttitude> attitude;
};

struct PoseEffect {
  const Effect* effect = nullptr;
  double constant = 0.0;                  // NaN: none
  std::vector<std::string> parameters;    // names
  std::vector<double> value, sigma;       // raw gyro units (per g, ...); of accelerometers g
  double log_p = 0.0;                     // F test, corrected for axes, effects and constants tried
  std::array<double, 3> held_out_rms{};   // of poses left out in turn, raw units, with this and what was named before
  std::vector<const Effect*> equivalent;  // explain the poses as well: the order of the poses does not tell them apart
  // Of what changes with time: the same test beside a 1/f noise as large as the halves of the poses show, corrected likewise; else `log_p`.
  double log_p_beside_flicker = 0.0;
  // Depends on the pose by no more than the Earth's rate does, which was not taken out: no heading, or no latitude.
  bool may_be_earth = false;
  bool may_be_flicker = false;  // not seen beside that noise: that it drifts is known, and not by what
};

// How much of what one effect would do another one does too, over the times and directions of these poses.
struct Confounded {
  const Effect* effect = nullptr;
  const Effect* with = nullptr;
  double shared = 0.0;  // R^2, beside a constant
};

// An axis that stands at an end of its range.
struct Clipping {
  bool gyro = true;
  int axis = 0;
  double limit = 0.0;                       // raw units, the larger of both ends
  double low = -HUGE_VAL, high = HUGE_VAL;  // the ends that it stands at
  std::size_t samples = 0;
  double first_s = 0.0, last_s = 0.0;  // since the start
};

// A stretch that no pose and no turn uses: the sensor did not answer in it, or the log holds no sample.
struct LeftOut {
  double first_s = 0.0, last_s = 0.0;  // since the start
  std::size_t samples = 0;
  std::string words;
};

// Bias and scale of the accelerometers that settle after each turn: r_i exp(-s/tau), or in proportion to the change of
// specific force along the axis.
struct Settling {
  double tau_s = 0.0;
  bool with_change = false;
  Vector3 size_g, sigma_g;  // g, or g per g of change
  double log_p = 0.0;
};

// Of one axis of a table that carries the sensor.
struct ReadOutAxis {
  std::string name;  // outer, inner
  int rows = 0;      // turns from stop to stop, or steady rates
  bool steady = false;
  bool oscillates = false;                                  // rows are reversals then
  double turned_deg = 0.0;                                  // all turns together
  double slowest_deg_per_s = 0.0, fastest_deg_per_s = 0.0;  // of steady rates
  Vector3 response, sigma;                                  // of the gyros in nominal rad/s per rad/s of the read-out
  std::optional<PoseParameter> nonlinearity;                // part of the response that grows with the rate, per rad/s
  double log_p_nonlinear = 0.0;
  // Of turns from stop to stop along the main axis: what one is off by, over the mean turn, and the correlation of turns that follow one
  // another where it is beyond chance; `sigma` holds it.
  double turn_scatter = 0.0, turns_alike = 0.0;
};

// The read-outs' clock against the sensors': a read-out that is late has a positive delay.
struct ReadOutClock {
  int turns = 0;
  double delay_s = 0.0, delay_sigma_s = 0.0;    // at the middle of the recording
  double growth_s = 0.0, growth_sigma_s = 0.0;  // over the recording
  double least_s = 0.0, most_s = 0.0, scatter_s = 0.0;
  // What the log's clock is faster by than the read-outs', relative. Where theirs is right, gains of gyros that give rates are less by it.
  double faster = 0.0, faster_sigma = 0.0;
};

// How gravity turns in the sensor while one axis of the table turns.
struct TableTilt {
  std::string axis;
  bool near_vertical = false;              // else the axis lies nearer to the horizontal, and its tilt is not seen
  double tilt_deg = 0.0, sigma_deg = 0.0;  // of an axis near the vertical against it
  double log_p_shape = 0.0;                // of twice the angle in the accelerometers, corrected: a nonlinearity
};

struct ReadOuts {
  std::vector<ReadOutAxis> axes;
  std::optional<ReadOutClock> clock;
  std::optional<TableTilt> tilt;
  Vector3 gyro_bias = Vector3::Zero(), gyro_bias_sigma = Vector3::Zero();  // raw
  int disagreeing = 0;                       // turns that read-outs and gyros disagree about
  int clipped_turns = 0, clipped_rates = 0;  // in which a gyro stands at the end of its range
};

// Allan deviation of a triad at rest (IEEE Std 952, annex C), raw units.
struct RestNoise {
  double tau_s = 0.0;
  std::array<double, 3> deviation{};
  double freedom = 0.0;  // means that do not overlap
};

// By how much the gyros' bias differs between the poses behind a gap of the log and those before the first one: switched off meanwhile? Without
// a gap: between two poses of which those before and behind explain all better by a step than by what changes steadily: a knock?
struct BiasJump {
  bool gap = true;
  double time_s = 0.0;  // of the gap's end, since the start
  Vector3 size, sigma;  // raw
};

// No effect of the catalogue: between two poses the accelerometers' bias became another.
struct AccelJump {
  // It is somewhere behind `from_pose` and before `to_pose`, counted from 1. They follow one another where one step alone is likely.
  int from_pose = 0, to_pose = 0;
  double from_s = 0.0, to_s = 0.0;  // since the start: where the one begins and the other ends
  Vector3 size_g, sigma_g;
};

struct PoseDiagnosis {
  Sensors sensors = Sensors::both;
  std::array<bool, 3> gyro_axes{true, true, true};  // which axes of gyros the log holds
  int poses = 0;
  bool means = false;  // a table's, a row a pose
  bool by_poses =
      false;  // whether they are enough for a reference: what follows of accelerometers and gyros is then filled
  double static_seconds = 0.0;
  double duration_s = 0.0;  // of the log
  std::vector<Clipping> clipped;
  std::vector<LeftOut> left_out;
  std::size_t spikes = 0;  // readings that stand alone, in whose place the mean of their neighbours is used
  // Accelerometers: bias, scale, misalignment fitted to |f| = g. The sensors' own matrix: reading = M force + bias, M less 1; of counts without a
  // nominal scale M_ii in raw/g and M_ij / M_ii.
  double accel_rms_g = 0.0, accel_held_out_rms_g = 0.0;
  bool accel_tested = false;  // whether there are poses enough to test what the model leaves
  std::optional<AccelJump> accel_jump;
  bool accel_adequate = false;
  double force_at_rest_g = 0.0;   // mean of |f| in nominal units; 0: the unit is not known
  double gravity_span_deg = 0.0;  // the largest angle between directions of gravity in the sensor
  std::vector<PoseParameter> accel_parameters;
  std::vector<PoseEffect> accel_tried;  // best first
  std::optional<Settling> settling;
  std::vector<PoseEffect> accel_named;  // what follows a measured temperature, SI; taken out of the parameters
  bool has_temperature = false;         // whether a channel of temperature moves from pose to pose
  // Gyros in the poses.
  std::array<double, 3> gyro_bias{}, gyro_bias_sigma{};  // raw units
  bool accel_reversed = false;  // whether the Earth's rate shows that all accelerometers are: it turns about their down
  std::optional<double> latitude_seen;  // rad, by the Earth's rate in the poses, where nobody says it
  double latitude_seen_sigma = 0.0;     // rad
  bool earth_taken_out = false;         // whether the Earth's rate was taken out of the gyros' means, heading included
  std::array<double, 3> gyro_held_out_rms{};  // bias alone, raw units
  std::array<double, 3> gyro_white_rms{};     // what white noise would leave of a pose's mean
  std::vector<BiasJump> gyro_jumps;           // beside which the effects are asked; empty: no gap, or none that shows
  std::vector<PoseEffect> gyro_tried;         // each alone, best first
  std::vector<PoseEffect> gyro_named;         // forward selection
  std::vector<PoseEffect> gyro_open;          // what is left beside what is named: coefficients and sigma
  std::vector<Confounded> confounded;
  // Direction of gravity carried from pose to pose: rms, rad; scale and misalignment of the gyros fitted, reading = M rate + bias, M less 1.
  int turns = 0, turns_clipped = 0;
  std::vector<PoseParameter> gyro_parameters;
  int turns_whole = 0;           // that go round so often that gravity's direction is not carried through them
  double gyro_raw_unit = 0.0;    // rad/s a raw unit, by the turns, where nobody says it; parameters are then in it
  std::string gyros_contradict;  // what of the gyros' unit or axes contradicts gravity's turns; empty: nothing
  double direction_before = 0.0, direction_after = 0.0;
  double direction_by_noise = 0.0;  // of the gyros' white noise, which is in their bias too
  double direction_before_held_out = 0.0, direction_after_held_out = 0.0;  // rotation and its poses left out
  int steady_turns = 0;              // stretches that are quiet and turn: no poses
  std::vector<double> other_forces;  // what quiet stretches read that are not at 1 g, g: no poses
  // At rest the accelerometers read these forces, g, by the gyros' rest no others than gravity: their zero is elsewhere, and follows from the poses.
  std::vector<double> forces_of_another_zero;
  int clipped_poses = 0;  // in which an accelerometer stands at the end of its range: their means are none
  int moving = 0;         // stretches as quiet as the log's quietest that move: no poses
  std::optional<ReadOuts> read_outs;
  std::optional<ByAttitude> by_attitude;
  std::optional<DividingHead> dividing_head;       // of one accelerometer; nothing else is filled then
  std::optional<Rest> rest;                        // of fewer poses than calibrate
  std::vector<RestNoise> gyro_noise, accel_noise;  // of the triads that the log holds, shortest time first
  std::string not_by_position;                     // why position at rest is no reference, if somebody asked
  std::vector<std::string> supports;               // what the recording is a reference for, in words
  std::vector<std::string> invisible;              // in words
  std::string failure;                             // empty: done
};

PoseDiagnosis diagnose_poses(const PoseInput& input, double false_alarm_rate);

}  // namespace selfcal::diagnosis
