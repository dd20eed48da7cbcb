// The calibration: 24 sensor errors from one recording, by forward and reverse navigation and filtering.
//
// Source: Zhang & Jiang (2019) for the 33 states and the passes; estimator/README.md derives what is
// done differently (each pass relinearises and counts every datum once).
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/models/imu_data.hpp"
#include "estimator/models/sensor_model.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal {

// Noise of the sensors and of the site; what is not given is estimated from the recording.
struct NoiseOptions {
  std::optional<double> gyro_arw;        // rad/s/sqrt(Hz)
  std::optional<double> accel_vrw;       // m/s^2/sqrt(Hz)
  std::optional<double> position_sigma;  // m, white, at 1 Hz
};

// 1 sigma: 10 ug, 0.005 deg/h, 10 ppm, 5 arcsec. Derivation in estimator/README.md.
ParameterVector default_tolerance();
// The largest size a parameter of such sensors can have: 10 mg, 2 deg/h, 5000 ppm, 1 deg.
ParameterVector plausible_limit();

struct CalibrationOptions {
  NoiseOptions noise;
  int max_passes = 12;             // after the noise is known; at least 3 in all: forward, reverse, forward
  double convergence_sigma = 0.1;  // stop when no parameter moved by more than this fraction of its sigma
  bool noise_of_drift = true;  // where the spectra mislead: densities from the drift of the navigation (noise_fit.hpp)
  bool carried_covariance = false;  // for comparison only: keep P from pass to pass, counting data again
  ParameterVector tolerance = default_tolerance();  // 1 sigma beyond which a parameter counts as not determined
};

enum class PassDirection { forward, reverse };

struct PassSummary {
  PassDirection direction = PassDirection::forward;
  double seconds = 0.0;             // of data
  double nis_mean = 0.0;            // normalised innovation squared per degree of freedom, 1 expected
  double largest_move_sigma = 0.0;  // largest change of a parameter since the pass before, in its sigma
  // Convergence within the pass (Figures 6 to 11 of the source): about 200 epochs.
  std::vector<double> epoch_s;
  std::vector<ParameterVector> epoch_parameters;
  std::vector<ParameterVector> epoch_sigma;
};

// One dwell or one rotation of the recording, as found in the gyros (and named from the gimbal, where present).
struct SegmentSummary {
  bool rotation = false;
  double start_s = 0.0;
  double end_s = 0.0;
  double outer_deg = 0.0;  // mean read-out, 0 where there is none
  double inner_deg = 0.0;
  double nis_mean = 0.0;
  int epochs = 0;
};

// A stretch whose samples are no observation, or only in part (models/imu_data.hpp).
struct LeftOut {
  double start_s = 0.0, end_s = 0.0;
  std::string fault;  // id of the fault of the data, or "disturbed"
  std::string words;
  bool turn = false;    // a turn that the gyros did not see: how far it went comes from what lies on both sides
  bool sensors = true;  // else a read-out or the temperature has other values there, and no sensor was left out
};

enum class Verdict { consistent, inconsistent, not_converged };

struct Consistency {
  Verdict verdict = Verdict::consistent;
  double nis_mean = 0.0;                 // final pass, per degree of freedom
  double nis_low = 0.0, nis_high = 0.0;  // its 99.9 % interval for a right model
  double whiteness_p_value = 0.0;        // portmanteau test on the innovations of the final pass
  double parity_max_sigma = 0.0;         // largest difference between last forward and last reverse answer, in sigma
  double autocorrelation = 0.0;          // of the normalised innovations at lag 1, mean of the axes
  std::string words;                     // one or two sentences for people
};

// Two gimbal positions, dwelt in one after the other, and what they would leave of a direction's sigma.
struct SupplyingTurn {
  GimbalPosition from, to;
  double sigma_after = 0.0;  // in units of the tolerance
};

// A direction in parameter space that the recording did not fix: unit vector in units of the tolerances.
struct UndeterminedDirection {
  ParameterVector direction;          // components along value/tolerance
  double sigma = 0.0;                 // in units of the tolerance
  std::vector<SupplyingTurn> supply;  // positions that would fix it, best first (planning/remedy.hpp fills it)
  std::string words;                  // which parameters move together, and which positions would fix it
};

struct CalibrationResult {
  ParameterVector value;  // SI
  ParameterVector sigma;  // SI
  std::array<bool, sensor_parameter_count> determined{};
  std::array<bool, sensor_parameter_count> plausible{};  // inside the possible range, or too poorly known to say
  ParameterMatrix covariance;                            // SI
  Matrix3 C_nb_start;                                    // attitude of the IMU at the first sample's start
  // About what the next pass, from the start, would be linearised: value and C_nb_start, but for what the data leave
  // open where the passes settled only without it (`held`).
  ParameterVector linearised_value;  // SI
  Matrix3 linearised_C_nb;
  bool held = false;
  Attitude initial_attitude;  // of the vehicle, using the gimbal read-out there (zero where absent), rad
  Vector3 attitude_sigma;     // phi north, up, east at the start, rad
  double gyro_arw = 0.0, accel_vrw = 0.0, position_sigma = 0.0;  // in use; SI
  double gyro_arw_sigma = 0.0;                                   // of the density as found; 0: not stated
  double gyro_quantum = 0.0, accel_quantum = 0.0;                // found in the increments; rad, m/s; 0: none
  NoiseModel noise;                                              // in use, with the motion of a moored base
  bool noise_given = false;                                      // a density, or the position's noise, was an option
  bool noise_of_drift = false;                                   // the spectra mislead: noise_fit.hpp
  bool moored = false;                                           // coloured motion of the base was found and modelled
  std::vector<Coast> coasts;                                     // of the data, with the turns as found
  std::vector<LeftOut> left_out;                                 // why; filled by the caller, who left it out
  ParameterVector sigma_whole;  // SI, what it would be if nothing were left out; sigma where nothing is
  std::vector<PassSummary> passes;
  std::vector<SegmentSummary> segments;
  Consistency consistency;
  std::vector<UndeterminedDirection> undetermined;
  double elapsed_s = 0.0;  // filled by the caller: libraries do not ask the time
};

// Why no answer could be computed at all (as against a bad answer, which is a CalibrationResult that says so).
struct CalibrationFailure {
  std::string message;
};

struct CalibrationProgress {
  int pass = 0;  // 1, 2, ...
  PassDirection direction = PassDirection::forward;
  double fraction = 0.0;  // of this pass
  ParameterVector value;  // SI
  ParameterVector sigma;  // SI
};

struct CalibrationOutcome {
  std::optional<CalibrationResult> result;
  CalibrationFailure failure;  // where there is no result
};

// Runs the whole calibration. `progress` may be empty; it is called from the calling thread a few times per pass.
// A stop request ends with a failure "stopped".
CalibrationOutcome calibrate(const ImuData& data, const CalibrationOptions& options,
                             const std::function<void(const CalibrationProgress&)>& progress = {},
                             const std::stop_token& stop = {});

}  // namespace selfcal
