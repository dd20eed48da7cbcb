// Laws in the place of names that leave nothing. Of a law that no catalogue holds an effect may make so much that the rest is lost in noise:
// g-sensitivity takes up a law of the gimbal's angles, two names may take up one creep, and a second name a law beside a true effect. The
// search is asked what it says of the recording with one of the names in it, with all of them, and with those that laws replace one by one.
// A remainder is of a name whose form differs a little. A law of the same sensors in its place may be that form (`own_form`): it is told, and the
// 24 are held to both. One of the other triad is other physics: a gyro that follows rate and force moves the direction of gravity as products
// of two accelerometers do, all but a tenth. Offsets that are drawn anew
// at each turn may stand in a name's place as well: a weak name follows some of a few of them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "estimator/discovery/named_effects.hpp"

namespace selfcal::discovery {

struct LawsForNames {
  std::vector<const diagnosis::Effect*> names;  // in whose place; none: the laws stand beside all of them
  std::vector<diagnosis::Diagnosis> without;    // [recordings] the diagnoses without these names
  UnexplainedRest rest;                         // the recordings less the names that stay
  LawSearch search;                             // of that, fitted
  double log_odds = 0.0;  // of what it found against these names, each with its costs (explanation_cost.hpp)
  // A law is of the triad of a name that leaves a remainder: it may be that name's own form, and is no other physics for its odds alone.
  bool own_form = false;
};

// Whether names of sensors are all that the diagnosis says, a remainder aside: nothing else is left, and no process stands beside them.
bool names_stand_alone(const diagnosis::Diagnosis& diagnosis);

// Recordings of one unit, all of them explained, some by names that stand alone: each by its own names, or all of them by the same laws in
// the place of some of these; one recording also by laws beside all of them, where that is ten times likelier. The names that stay are fitted
// anew beside the laws. None where that is not so, where no law is the likelier one by the logarithm of odds of `least_log_odds` (it may be
// below 0), or where a process is among the laws. Jumps at turns, without a law, are likelier in the same way. A search is made only where a
// single function, or jumps, gain enough in a name's place, and for three choices of names at most, the most probable ones first; once more
// where some of the names beside some of the laws are likelier than the laws alone, and where of a name that stays nothing is left beside the
// laws.
std::optional<LawsForNames> laws_for_names(std::span<const DiagnosedRecording> unit, double least_log_odds,
                                           const DiscoveryOptions& of_laws, const Progress& progress = {});

}  // namespace selfcal::discovery
