// Whether a law's form is short of what its axis does: the law times each plain quantity, beside it.
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>

#include "estimator/discovery/law_fit.hpp"
#include "estimator/laws/expression.hpp"

namespace selfcal::discovery {

// Natural logarithm of the probability that a true form departs as far as term k of the fit does, corrected for the number of
// quantities. A law that only nearly has the right form is off where one of the quantities is large, and then the law times that
// quantity gains: of a few hundred functions fewer are asked than the search asks, so that less shows. Zero where the recording
// tells nothing.
double log_p_of_departure(std::span<const LawRecording> recordings, const LawFit& fit, std::size_t k,
                          const laws::VariableSet& available, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
