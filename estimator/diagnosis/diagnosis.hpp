// When simulation and recording differ: where, which physics was left out, the model with it, and the proof.
//
// Rows of a signature pass (signature_pass.hpp) make every question a linear regression with unit noise:
// README.md derives the tests and the thresholds.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/diagnosis/data/read_out_delay.hpp"
#include "estimator/diagnosis/effects/effect.hpp"
#include "estimator/diagnosis/noise/base_tilt.hpp"
#include "estimator/diagnosis/noise/noise_check.hpp"
#include "estimator/diagnosis/noise/velocity_jumps.hpp"
#include "estimator/diagnosis/regression/recording_context.hpp"
#include "estimator/diagnosis/search/locate.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal::diagnosis {

struct DiagnosisOptions {
  // Of a whole recording, over all tests: half of what is promised (1 %), for the null distributions are approximations.
  double false_alarm_rate = 0.005;
  AssumedNoise assumed;  // what the simulation takes for the sensors
  CalibrationOptions calibration;
  std::stop_token stop;  // asked for between steps: the failure is then "stopped"
};

struct FindingParameter {
  std::string name, unit;
  double value = 0.0, sigma = 0.0;  // in the unit
  std::string physics_key = {};     // its name in a physics file; empty: name and value are the file's too
  double physics_value = 0.0;       // in that file's unit
};

struct Finding {
  std::string effect;              // its id, or that of a noise
  const Effect* source = nullptr;  // of the catalogue; null: noise
  std::string equation, excited;
  std::vector<FindingParameter> parameters;
  std::vector<std::string> equivalent;        // ids of effects that explain the recording as well
  std::vector<const Effect*> rivals;          // the same effects
  std::map<std::string, double> probability;  // by id, of every effect in this one's place, all equally likely before
  std::string experiment;                     // what would tell them apart
  double significance = 0.0;                  // sigma, after correction for all that was tested
  double log_p = 0.0;                         // the same, natural logarithm
  double delta_bic = 0.0;                     // fall of the BIC: positive speaks for it
  double held_out_gain = 0.0;                 // log-likelihood on dwells and rotations left out in turn
  double share = 0.0;                         // of the misfit that it takes away, given the other findings; 0 for noise
  bool stochastic = false;                    // a noise model, not a mean
  bool process = false;                       // of a bias: a random walk, an instability
};

// A way in which a named effect differs from its equation.
struct FormLeft {
  std::string effect, words;
  double share = 0.0;  // of the misfit
};

// What the named equations leave where they are the answer all the same: small beside what they explain, and of a form that they
// may take in nature. Sigma of the 24 holds what it may do to them.
struct Remainder {
  double share = 0.0;  // of the misfit
  double sigma = 0.0;  // its size, sigmas
  std::vector<FormLeft> forms;
  std::vector<Located> places;  // where it shows, largest first
};

// One equation of the model that the findings make: for use on other recordings.
struct ModelEffect {
  const Effect* effect = nullptr;  // of the catalogue
  double constant = 0.0;           // NaN: none
  Eigen::VectorXd size;            // in typical sizes
  Eigen::MatrixXd covariance;
};

// Laws that explain the recording in the place of names of sensors, of one, of some or of all (discovery/laws_for_names.hpp).
struct LawsInstead {
  struct Law {
    int place = 0;  // of the axis: gyro x, y, z, accelerometer x, y, z
    std::string axis, expression;
    double coefficient = 0.0, sigma = 0.0;  // ug or deg/h
    std::string process = {};               // "jump per turn" of that size; empty: an equation
  };
  std::vector<Law> laws;
  std::vector<const Effect*> names;  // in whose place; the others stand beside the laws too
  double odds = 0.0;                 // against these names
};

struct Undetectable {
  const Effect* effect = nullptr;
  double expected_z = 0.0;  // of its best coefficient at typical size
};

struct Adequacy {
  double nis = 0.0;  // per degree of freedom
  double log_p_white = 0.0;
  bool coloured = false;         // the sensors' quantum and lines colour the innovations: whiteness is not judged
  double largest_sigma = 0.0;    // of the map
  double misfit = 0.0;           // sum of squares beyond the degrees of freedom
  double log_p_structure = 0.0;  // of biases that many dwells, rotations or times share; after the fit only
  bool accepted = false;
};

enum class DiagnosisVerdict { adequate, named, none_of_the_above, not_enough_information, data_fault };

struct Diagnosis {
  DiagnosisVerdict verdict = DiagnosisVerdict::adequate;
  bool mismatch = false;
  bool unexplained = false;
  // No rotation: a bias that changes and a base that moves look alike, and the 24 are open. Only the noise was judged.
  bool nothing_turned = false;
  std::optional<BaseTilt> base_tilt;  // then
  std::optional<ReadOutDelay> read_out_delay;
  // By how much the gyros' noise turns the attitude in all of the recording (rad, 1 sigma), where that is so much that effects were not looked
  // for in what the model explains; 0: they were. Along such an attitude what an effect makes holds the noise itself.
  double attitude_wanders = 0.0;
  std::vector<DataFault> faults;
  std::vector<Finding> findings;   // best first
  std::vector<Finding> rejected;   // fitted best, but what remains says no
  std::vector<Finding> suspected;  // too weak to name
  std::optional<Remainder> remainder;
  std::optional<LawsInstead> instead;  // the mean and sigma of the 24 hold both
  std::vector<Located> located, remaining;
  std::vector<Located> located_by, remaining_by;  // by gimbal angles, directions, temperature: the worst of each
  std::vector<Undetectable> undetectable, detectable;
  Adequacy before, after;
  NoiseCheck noise;
  std::vector<VelocityJump> jumps;  // there nothing was concluded from the velocity
  double loudest = 1.0;             // the accelerometers' noise in the loudest tenth of the intervals over the median's
  CalibrationResult calibration;    // of the 24 alone
  std::vector<ModelEffect> model;   // equations among the findings
  // Equations among what is rejected, and whether nothing but what they leave speaks against them: no walk beside them, and not
  // that they are nearly one.
  std::vector<ModelEffect> rejected_model;
  bool rejected_by_remains_alone = false;
  double log_p_limit = 0.0;  // natural logarithm of p, not corrected, below which one test of an effect is a name
  double mean_temperature_c = 0.0;  // of the recording; 0 without a channel
  // Of the 24, SI: mean and sigma over all explanations that the recording leaves open; and with `model` as it is.
  ParameterVector value, sigma;
  ParameterVector value_as_named;
  ParameterMatrix covariance;  // of value
  // By how much more value_as_named may be off than were `model` the truth: other names in its place, forms that are open, and that it
  // is not the mean.
  ParameterMatrix open_beside_named = ParameterMatrix::Zero();
};

// Nothing turned, and the position departs by more than noise of the model does: what changes is asked of the log as one that
// stands (poses/rest.hpp).
inline bool wanders_at_rest(const Diagnosis& d) {
  constexpr double least = 0.5, most = 2.0;  // NIS
  return d.nothing_turned && (d.before.nis < least || d.before.nis > most);
}

struct DiagnosisOutcome {
  std::optional<Diagnosis> diagnosis;
  std::string failure;
};

DiagnosisOutcome diagnose(const ImuData& data, const DiagnosisOptions& options,
                          const std::function<void(const std::string&)>& progress = {});

}  // namespace selfcal::diagnosis
