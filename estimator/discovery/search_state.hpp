// What the search for laws has decided, by what it decides, and whether another way through it explains the recordings as well.
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

constexpr int constant_rounds = 4;  // of an exact fit
// Costs are minus the logarithms of probabilities that add up to 1 over all functions and axes, so that p times their
// exponential is corrected for all of them. Laws and processes take half of the false-alarm rate each.
constexpr double shares = 2.0;

// Logarithm of the probability that noise gains as much, corrected for all functions.
double log_p_of_law(double gain, std::size_t constants, double cost);
// Whether law k of the fit gains on what is left out what it would gain there, were it true, with a constant inside its range, and
// leaves the 24 where a sensor may have them.
bool stands(const LawFit& fit, std::size_t k);
double cost_of_laws(const SearchState& state);
std::vector<LawTerm> all_but(std::vector<LawTerm> terms, std::size_t k);
// Logarithm of the posterior probability of laws without a process, but for a constant.
double log_posterior_of_laws(const SearchState& state);

// What the search says of law k by itself: its equation, coefficient, constants with their sigmas, gains and significance.
void write_numbers(DiscoveredLaw& law, const SearchState& state, std::size_t k, std::vector<Constant> constants);

// `other` as an explanation in the place of `told`, the logarithm of whose odds against it is `ahead` (0 or more). None where the odds
// are less than `least_odds`, or where both say the same but for numbers.
std::optional<OtherExplanation> other_explanation(const SearchState& told, const SearchState& other, double ahead,
                                                  double least_odds);

}  // namespace selfcal::discovery
