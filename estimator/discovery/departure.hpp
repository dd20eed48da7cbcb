// Whether a law's form is short of what its axis does: the law times each quantity, its size and its square, beside it.
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/discovery/law_fit.hpp"
#include "estimator/laws/expression.hpp"

namespace selfcal::discovery {

// A law times a quantity, and the probability with which a form that is not known departs there, before any data.
struct Departure {
  LawTerm term;
  std::string quantity;
  double belief = 0.0;  // adds up to 1 over all of a law's, where all channels are there
};
std::vector<Departure> departures_of(const LawTerm& law, const laws::VariableSet& available);

// How far a law departs, and with which quantity most.
struct Departed {
  double log_p = 0.0;    // natural logarithm of the probability that a true form departs as far
  std::string quantity;  // empty: no departure counts
};

// What these fits say of a law that gains `gain`, corrected for all of them by their beliefs.
Departed departed(std::span<const Departure> departures, std::span<const SingleFit> fits, double gain);

// Of term k of the fit. A law that only nearly has the right form is off where one of the quantities is large, and then the law times
// that quantity gains: of a few hundred functions fewer are asked than the search asks, so that less shows.
Departed departed(std::span<const LawRecording> recordings, const LawFit& fit, std::size_t k,
                  const laws::VariableSet& available, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
