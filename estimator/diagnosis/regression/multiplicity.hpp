// How many tests the catalogue is worth on one recording.
#pragma once

#include <vector>

#include "estimator/diagnosis/regression/evidence.hpp"

namespace selfcal::diagnosis {

// The scores of a recording without left-out effects are N(0, information): signatures that look alike here give tests
// that fail together. Drawn from that distribution, the smallest log_detection of all candidates has an `alpha`
// quantile q; p-values count for alpha / q tests. Deterministic. Its own scatter: 1/sqrt(draws * alpha) of the count.
double effective_tests(const Evidence& evidence, const std::vector<Candidate>& candidates, double alpha);

}  // namespace selfcal::diagnosis
