// Whether a law stays the best one when parts of the recording are left out.
//
// Dwells and rotations are left out at random, a quarter of them each time, and the candidates compared again (resampling as in
// stability selection: Meinshausen and Buehlmann 2010).
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "estimator/discovery/shortlist.hpp"

namespace selfcal::discovery {

// Share of the draws in which the best of `candidates` beside `given`, by merit, is one of the first `members` of them.
double stability(std::span<const LawRecording> recordings, const std::vector<LawTerm>& given,
                 const std::vector<Candidate>& candidates, std::size_t members, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
