// Names of the catalogue that were rejected by what they leave, where the search finds nothing better: it tells the same function once
// more, as an equation. One in a hundred right names is rejected so, and a form that is slightly off more often.
#pragma once

#include <stop_token>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal::discovery {

// Of each law whether one of the effects, fitted anew, makes all but two per cent of it. `model`: effects of sensors.
std::vector<bool> made_by_effects(const UnitRecording& recording, const std::vector<diagnosis::ModelEffect>& model,
                                  const std::vector<LawTerm>& laws, const std::stop_token& stop = {});

// Looks for laws that are what a rejected effect of the catalogue makes, fitted anew, and says so in them (`effect`). True where the laws
// alone explain the recording and the rejected effects make all of them, as well but for less than a search among so many functions
// gains by chance. `recording`: the one that `found` is of.
bool say_what_was_rejected(const UnitRecording& recording, const diagnosis::Diagnosis& diagnosis, Discovery& found,
                           const std::stop_token& stop = {});

// Then the names stand, with what they leave as their remainder. `found` holds it (`left`).
void keep_rejected_names(diagnosis::Diagnosis& diagnosis, const Discovery& found);

}  // namespace selfcal::discovery
