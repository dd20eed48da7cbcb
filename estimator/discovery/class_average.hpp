// The 24 of each recording over all equations that the recordings leave open.
//
// Where a class has several members, each of them in the law's place leads to its own 24. Their mean, weighted by the odds, and
// their spread are the answer; that of several laws adds up, as if the choices were independent. What is only described is in
// all of these fits, with the spread of its own class, and its true form may move the 24 as far again as this one does, and farther by what they take up of it unseen
// (absorbed.hpp). Beside a process no class is looked at.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/shared_parameters.hpp"

namespace selfcal::discovery {

// `found` of these recordings, `told_alone` the fit of its `laws` without what is described (laws_leave.hpp). `members` of a class
// at most, the most probable ones: one pass over each recording for each.
ClassAverage average_over_classes(std::span<const UnitRecording> recordings, const Discovery& found,
                                  const LawFit& told_alone, std::size_t members = 8, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
