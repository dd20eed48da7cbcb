// Which of the laws that were found are told as equations, and which only describe what their axis does.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

// Whether equations and processes on this axis rule it out, before their classes are looked at, that its form is known.
bool is_crowded(int axis, std::span<const LawTerm> terms, std::span<const double> gains,
                std::span<const DiscoveredProcess> processes);

// Of what the laws of an axis gain together, the share that none of them gains beside the others: either does the other's work there. Two
// that gain as much and whose signatures have the correlation r share r. 0 where the axis has less than two; below 0 where they
// work against each other. `fit`: of these recordings.
double overlap_on_axis(std::span<const LawRecording> recordings, const LawFit& fit, int axis,
                       const std::stop_token& stop = {});

struct TellingLaws {
  std::vector<DiscoveredLaw> told, described;  // both in the order of `laws`
};

// An axis whose form is none of those found is described only, with all equations on it. It is known by one of these:
// - a law on it departs from what the axis does (departure.hpp), or the axis holds more than its laws (lack_of_fit.hpp), than of
//   `departure_rate` of true laws each;
// - a law on it is a wave over the time that keeps step with the turns (step_with_turns.hpp);
// - a process of its own stands beside the equation;
// - three equations share it, or two of which the smaller takes less than half of what the larger does, or of which one
//   more probably fails on another plan than not, or which share more than a third of what they gain: they are more probably one law
//   whose form none of them has; the same where two are functions of the same quantities and of no others;
// - the only law of all is strong and more probably fails on another plan than not (`unsure`): all that stands in its class is nearly it on
//   these recordings and something else elsewhere, and none of it is known to be the law;
// - a law that takes less than a tenth of what its law takes may as well follow this axis: that is what the form lacks.
// What is weaker than an axis that is only described may be what this one's form leaves, and is described too.
TellingLaws tell_laws(std::vector<DiscoveredLaw> laws, std::span<const DiscoveredProcess> processes,
                      double departure_rate);

}  // namespace selfcal::discovery
