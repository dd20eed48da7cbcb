// Laws in the place of names that leave nothing. Of a law that no catalogue holds an effect may make so much that the rest is lost in noise:
// g-sensitivity takes up a law of the gimbal's angles, and two names may take up one creep. The search is asked what it says of the
// recording with the names in it.
#pragma once

#include <optional>
#include <span>

#include "estimator/discovery/named_effects.hpp"

namespace selfcal::discovery {

struct LawsForNames {
  LawSearch search;       // of the recordings with all of it in, fitted
  double log_odds = 0.0;  // of its laws against the names, each with what it costs (explanation_cost.hpp)
};

// Whether names of sensors are all that the diagnosis says: nothing is left, nothing of another form, and no process stands beside them.
bool names_stand_alone(const diagnosis::Diagnosis& diagnosis);

// Recordings of one unit, all of them explained, some by names that stand alone: each by its own names, or all of them by the same laws.
// None where that is not so, where no law is the likelier one by the logarithm of odds of `least_log_odds` (it may be below 0), or where a
// process is among what the search finds. Where no single function takes up what the names do, it ends after the wide search.
// `as_they_are`: the same recordings, with the calibrations that the diagnoses are of; they must outlive the result.
std::optional<LawsForNames> laws_for_names(std::span<const DiagnosedRecording> unit,
                                           std::span<const UnitRecording> as_they_are, double least_log_odds,
                                           const DiscoveryOptions& of_laws, const Progress& progress = {});

}  // namespace selfcal::discovery
