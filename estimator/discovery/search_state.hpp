// What the search for laws has decided, and whether another way through it explains the recordings as well.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/discovery/discovery.hpp"

namespace selfcal::discovery {

struct SearchState {
  std::vector<LawTerm> terms;
  std::vector<double> costs;  // of the terms: minus the logarithm of their probability before data
  LawFit fit;
  std::vector<DiscoveredProcess> processes;
  double half_log_determinant = 0.0;  // of the processes: what their freedom costs
  double log_p_remaining = 0.0;
  std::string refused;
};

// `other` as an explanation in the place of `told`, the logarithm of whose odds against it is `ahead` (0 or more). None where the odds
// are less than `least_odds`, or where both say the same but for numbers.
std::optional<OtherExplanation> other_explanation(const SearchState& told, const SearchState& other, double ahead,
                                                  double least_odds);

}  // namespace selfcal::discovery
