// Effects that the catalogue names, laws and the 24, fitted together on all recordings of a unit.
//
// Of each recording the 24 and the effects' coefficients are its own at first; laws have one coefficient and one set of
// constants. All of them are one Gaussian vector (joint_gaussian.hpp). What of the 24 is shared is decided, then which
// coefficients of an effect are: what the data allow to be the same is, and the rest stays free. So every sigma holds what the
// others leave open.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/discovery/common_coefficients.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/effect_columns.hpp"
#include "estimator/discovery/shared_parameters.hpp"

namespace selfcal::discovery {

// An effect on the recordings that can hold it: `on[r]` empty of size where recording r cannot. Its constant is free where the
// recording named it.
struct UnitEffect {
  const diagnosis::Effect* effect = nullptr;
  std::vector<EffectTerm> on;  // [recordings]

  bool on_recording(std::size_t r) const { return on[r].size.size() > 0; }
};

struct EffectFit {
  std::size_t recording = 0;
  Eigen::VectorXd size, sigma;  // [coefficients] in typical sizes
  Eigen::MatrixXd covariance;   // [coefficients] of size
  double constant = NAN, constant_sigma = 0.0;
};

struct FittedEffect {
  const diagnosis::Effect* effect = nullptr;
  double log_p_common =
      0.0;  // that all of it is the same in all recordings, the logarithm of the p-value; 0 with one recording
  double log_p_none = 0.0;   // that it has no coefficient in any recording, given all the rest, the same
  std::vector<bool> common;  // [coefficients, and the constant where there is one]
  std::vector<UnsharedCoefficient> differing;  // of what is not common
  std::vector<EffectFit> each;                 // of the recordings that can hold it

  bool all_common() const;
  bool nothing_left() const;  // p of log_p_none above 0.01
};

// A law's coefficient and one of an effect's of which the recordings tell little more than a combination.
struct Entangled {
  std::size_t law = 0;     // of the laws that were fitted
  int axis = 0;            // of it
  std::string expression;  // constants as numbers
  std::size_t effect = 0, recording = 0;
  int coefficient = 0;
  double correlation = 0.0;  // of their errors
};

struct JointFit {
  std::vector<FittedEffect> effects;
  SharedParameters shared;  // the 24, and the laws' coefficients, with all that was fitted unknown
  std::vector<Entangled> entangled;
};

// The effects as fitted, where the next fit goes on from.
struct JointStart {
  std::vector<UnitEffect> effects;
  std::vector<LawTerm> laws;    // constants as found: their values stay, and sigma holds that they are not known
  Eigen::VectorXd coefficient;  // [laws] in unit_of(axis)
};

// A recording as it came and where a pass over it is linearised. Both must outlive it.
struct JointRecording {
  const ImuData& data;
  PassInput about;
};

// Recording r less the effects as they are in `start`.
diagnosis::CorrectedRecording without_effects(const JointRecording& recording, std::size_t r, const JointStart& start);

// Relinearised about the recordings less all that is fitted, `rounds` times. Leaves what was fitted in `start`. The failure is
// that of a calibration, or "stopped".
tl::expected<JointFit, std::string> fit_jointly(std::span<const JointRecording> unit, JointStart& start, int rounds,
                                                const std::stop_token& stop = {});

// Coefficient and sigma of laws as the joint fit has them, in the place of those of a fit that took the effects and the 24 of
// each recording by themselves. What sigma held beyond the linear fit it still holds. The 24 over the class follow.
void adopt(const JointFit& joint, Discovery& found);

// The names of the first recording, in `diagnosis`, likewise: their sizes were fitted while something stood in the place of the laws. Their
// significance is then given the laws, and not corrected for what was tried.
void adopt(const JointFit& joint, diagnosis::Diagnosis& diagnosis);

}  // namespace selfcal::discovery
