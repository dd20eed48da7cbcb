// A user's own equations, tried on a recording: significance, coefficients, what they leave, held-out proof.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/joint_fit.hpp"

namespace selfcal::discovery {

struct TriedLaw {
  LawTerm term;                           // constants as fitted
  std::string expression;                 // constants as numbers
  double coefficient = 0.0, sigma = 0.0;  // in unit_of(axis)
  std::vector<Constant> constants;        // the k-th `?` is "constant k"
  double significance = 0.0;              // sigma, corrected for the peaks that free constants had to choose from
  double gain = 0.0, held_out_gain = 0.0, share = 0.0;
  double stated = 0.0;              // the file's coefficient; NaN: none
  double collinear = 0.0;           // share of its information that the other laws and the constants take, 0 to 1
  double least_sigma_unseen = 0.0;  // with a larger one the 24 hold all of it, or it hardly acts
  bool seen() const { return sigma < least_sigma_unseen; }
  double log_peaks = 0.0;  // of the peaks that free constants had to choose from
  std::vector<std::string>
      shares_with;  // "effect coefficient": of an effect that was named, where the data tell a combination
};

struct LawTrialFailure {
  std::size_t law = 0;  // from 0
  std::string words;
};

// All together, beside the 24 of each recording. Free constants are looked for from 0.001 to 100,000 of either sign (three and
// more one after the other) and refined, whatever they are at the start. A law that needs a channel that a recording has not, or whose expression is not
// finite somewhere on one, is a failure. `stated` [laws], NaN where the file has no coefficient.
tl::expected<std::vector<TriedLaw>, LawTrialFailure> try_laws(std::span<const UnitRecording> recordings,
                                                              const std::vector<LawTerm>& laws,
                                                              const std::vector<double>& stated);

// Coefficient, sigma and significance as the joint fit with the effects that were named has them; its laws are these.
void adopt(const JointFit& joint, std::vector<TriedLaw>& tried);

}  // namespace selfcal::discovery
