#include "estimator/discovery/search_state.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selfcal::discovery {
namespace {

// Axis and form of all laws and processes, in an order.
std::vector<std::pair<int, std::string>> parts_of(const SearchState& state) {
  std::vector<std::pair<int, std::string>> all;
  for (const LawTerm& term : state.terms) {
    all.emplace_back(term.axis, term.expression.text(std::vector<double>(term.constants.size(), 1.0)));
  }
  for (const DiscoveredProcess& process : state.processes) {
    all.emplace_back(process.axis, name_of(process.kind));
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

std::optional<OtherExplanation> other_explanation(const SearchState& told, const SearchState& other, double ahead,
                                                  double least_odds) {
  const double odds = std::exp(-ahead);
  if (odds < least_odds || parts_of(told) == parts_of(other)) {
    return std::nullopt;
  }
  OtherExplanation instead{{}, other.processes, odds};
  for (const LawTerm& term : other.terms) {
    instead.laws.push_back({term.axis, term.expression.text(term.constants)});
  }
  return instead;
}

}  // namespace selfcal::discovery
