#include "estimator/discovery/search_state.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "estimator/passes/calibration.hpp"
#include "estimator/statistics/distributions.hpp"

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

// A true law of z sigma gains (z^2 - 1)/2 on what was left out, for each of some forty parts is predicted from the rest; what
// gains less than half of what it gains in the fit follows the noise.
constexpr double least_held_out_share = 0.5;

// A law that moves one of the 24 by more than this share of what a sensor may have is all but one of them: rate of an axis of b beside half
// a degree of misalignment is the Earth's rate along that axis, and some other drift of such a form the truth.
constexpr double most_of_a_limit = 0.5;

bool moves_the_24_too_far(const LawFit& fit, std::size_t k) {
  const auto column = static_cast<Eigen::Index>(k);
  const ParameterVector most = most_of_a_limit * plausible_limit();
  return std::any_of(fit.recordings.begin(), fit.recordings.end(), [&](const FittedRecording& r) {
    return (r.shift.col(column).array().abs() * std::abs(fit.coefficient(column)) > most.array()).any();
  });
}

}  // namespace

double log_p_of_law(double gain, std::size_t constants, double cost) {
  return log_chi_squared_tail(gain, constants > 1 ? 2.0 : 1.0) + cost + std::log(shares);
}

bool stands(const LawFit& fit, std::size_t k) {
  return fit.held_out_gain[k] > least_held_out_share * 0.5 * fit.gain[k] && !fit.terms[k].at_its_limit() &&
         !moves_the_24_too_far(fit, k);
}

double cost_of_laws(const SearchState& state) { return std::accumulate(state.costs.begin(), state.costs.end(), 0.0); }

std::vector<LawTerm> all_but(std::vector<LawTerm> terms, std::size_t k) {
  terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(k));
  return terms;
}

double log_posterior_of_laws(const SearchState& state) { return -0.5 * state.fit.square_after - cost_of_laws(state); }

void write_numbers(DiscoveredLaw& law, const SearchState& state, std::size_t k, std::vector<Constant> constants) {
  const LawTerm& term = state.terms[k];
  const auto row = static_cast<Eigen::Index>(k);
  auto at = static_cast<Eigen::Index>(state.terms.size());
  for (std::size_t j = 0; j < k; ++j) {
    at += static_cast<Eigen::Index>(state.terms[j].constants.size());
  }
  law.term = term;
  law.expression = term.expression.text(term.constants);
  law.coefficient = state.fit.coefficient(row);
  law.sigma = std::sqrt(state.fit.covariance(row, row));
  law.constants = std::move(constants);
  for (Constant& constant : law.constants) {
    constant.sigma = std::sqrt(std::max(0.0, state.fit.covariance(at, at)));
    ++at;
  }
  law.gain = state.fit.gain[k];
  law.held_out_gain = state.fit.held_out_gain[k];
  law.significance = sigma_from_log_p(std::min(0.0, log_p_of_law(law.gain, term.constants.size(), state.costs[k])));
}

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
