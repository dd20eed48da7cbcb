// One pass of navigation and filtering over a whole recording, forward or in reverse.
//
// The pass linearises about a trajectory: the given parameters and the attitude integrated from the given start. The
// filter is exact for the linearised problem and starts from the prior every time, so that its covariance counts each
// datum once; a sequence of passes is a Gauss-Newton iteration (estimator/README.md, "Passes").
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "estimator/filter/ud_filter.hpp"
#include "estimator/navigation/interval_navigator.hpp"
#include "estimator/passes/dynamic_transition.hpp"
#include "estimator/passes/motion_model.hpp"

namespace selfcal {

// A stretch in which people, wind or a knock made the noise larger: its variance, by `factor`.
struct Disturbance {
  double start_s = 0.0, end_s = 0.0;
  double factor = 1.0;
};

// White noise of each sensor axis by itself. That of the accelerometers' integral (a coarse quantum, dither that leaks through)
// makes the position walk.
struct AxisDensities {
  Vector3 gyro_arw = Vector3::Zero();        // rad/s/sqrt(Hz)
  Vector3 accel_vrw = Vector3::Zero();       // m/s^2/sqrt(Hz)
  Vector3 accel_integral = Vector3::Zero();  // m/s/sqrt(Hz)
};

struct NoiseModel {
  double gyro_arw = 0.0;              // rad/s/sqrt(Hz); of a triad, root of the mean square of its axes
  double accel_vrw = 0.0;             // m/s^2/sqrt(Hz)
  std::optional<AxisDensities> axes;  // in the place of both, where the axes of a triad are not alike
  ObservationModel observation;
  std::vector<BiasNoise> biases;       // that change with time
  std::vector<Disturbance> disturbed;  // chronological, no two overlap
  std::vector<Disturbance> shaken;     // the same of the accelerometers' noise alone, beside `axes`
  // Of the variance of an interval whose middle is at `time_s`.
  double inflation(double time_s) const;
  double shaking(double time_s) const;
};

// 1 sigma before any data. The navigation part is wide enough to say nothing.
struct PriorModel {
  double position = 10.0;          // m
  double velocity = 2.0;           // m/s
  double attitude = 0.2;           // rad
  VectorX parameter_sigma;         // [24 + extra], about zero
  std::optional<MatrixX> carried;  // [24 x 24] instead, about the linearisation: counts data again
};

// A trajectory as navigated once: passes that differ by noise alone need no other.
struct Navigated {
  std::vector<Interval> intervals;
  std::vector<Matrix3> C_nb;  // at the end of each
};

struct PassInput {
  const ImuData* data = nullptr;
  ParameterVector parameters = ParameterVector::Zero();  // linearisation
  VectorX extra_prior_mean;                              // [extra] prior mean less linearisation; may be empty
  Matrix3 C_nb = Matrix3::Identity();                    // where the pass begins
  double sign = 1.0;
  double interval_s = 1.0;
  NoiseModel noise;
  PriorModel prior;
  ExtraSignatures* extra = nullptr;
  ForceSource force = ForceSource::accelerometers;
  const Navigated* navigated =
      nullptr;  // of this data, linearisation, direction and interval, without `extra`; else navigated here
  // What the gyros did not see of turns are constants of the state, known at the end by all of the pass, not noise by which the
  // attitude opens. Who iterates needs it: the second order of a heading that one dwell tells to 2 mrad is 4 ug. Without `carried`.
  bool turns_are_constants = false;
  bool held = false;  // who iterates keeps the linearisation: along what the data leave open it would walk away
};

struct Epoch {
  double time_s = 0.0;             // where the position is observed
  double interval_middle_s = 0.0;  // of the data between this observation and the one before
  Vector3 innovation;              // m, each given those before it
  Vector3 variance;                // predicted, m^2
  Vector3 position;                // position state after the update, m: minus the motion of the base
};

struct PassOutput {
  StateLayout layout;
  VectorX mean;  // of the state at the end of the pass
  MatrixX covariance;
  Matrix3 C_nb;  // attitude at the end, corrected
  std::vector<Epoch> epochs;
  double nis_mean = 0.0;  // per degree of freedom
  double log_likelihood = 0.0;
  std::vector<double> history_s;
  std::vector<ParameterVector> history_value, history_sigma;
  std::vector<Matrix3>
      turns;  // of the data's coasts, as known after the pass; as they were, but for `turns_are_constants`
  bool stopped = false;
};

// Told a few hundred times per pass: fraction done, parameters and their sigma (SI).
using PassProgress = std::function<void(double, const ParameterVector&, const ParameterVector&)>;
// Shown every interval after it was propagated and before its observation, and every scalar update after it.
class PassObserver {
 public:
  virtual ~PassObserver() = default;
  virtual void propagated(const Interval& interval, const UdFilter& filter) = 0;
  virtual void updated(int axis, const VectorX& h_dynamic, const ScalarInnovation& innovation,
                       const UdFilter& filter) = 0;
};

Navigated navigate(const PassInput& input);

PassOutput run_pass(const PassInput& input, const PassProgress& progress = {}, const std::stop_token& stop = {},
                    PassObserver* observer = nullptr);

}  // namespace selfcal
