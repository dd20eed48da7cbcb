// Whether a law's form is short of what its axis does: the law times each quantity, its size and its square, beside it.
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>
#include <vector>

#include "estimator/discovery/law_fit.hpp"
#include "estimator/laws/expression.hpp"

namespace selfcal::discovery {

// A law times a quantity, and the probability with which a form that is not known departs there, before any data.
struct Departure {
  LawTerm term;
  double belief = 0.0;  // adds up to 1 over all of a law's, where all channels are there
};
std::vector<Departure> departures_of(const LawTerm& law, const laws::VariableSet& available);

// Natural logarithm of the probability that a true form that gains `gain` departs as far as these fits say, corrected for all of them
// by their beliefs.
double log_p_of_departure(std::span<const Departure> departures, std::span<const SingleFit> fits, double gain);

// Of term k of the fit. A law that only nearly has the right form is off where one of the quantities is large, and then the law times
// that quantity gains: of a few hundred functions fewer are asked than the search asks, so that less shows. Zero where the recording
// tells nothing.
double log_p_of_departure(std::span<const LawRecording> recordings, const LawFit& fit, std::size_t k,
                          const laws::VariableSet& available, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
