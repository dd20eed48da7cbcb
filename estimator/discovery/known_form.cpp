#include "estimator/discovery/known_form.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "estimator/discovery/search_state.hpp"

namespace selfcal::discovery {
namespace {

constexpr double comparable = 0.5;  // share of the larger of two gains
constexpr double more_likely_than_not = 0.5;
// Two laws drawn by themselves share little: the 33 states, projected out of both, take what is alike in them. Of one law whose form
// neither has, both do a part and the second mends the first.
constexpr double largest_overlap = 1.0 / 3.0;
// Of a law's gain: what its form may lack where it is to predict (carry_over.hpp).
constexpr double shadow_share = 0.1;
// Probability that the weaker law follows the stronger one's axis, beyond which it counts as its shadow. At one in twenty
// the odds of another axis are no longer beyond doubt.
constexpr double shadow_odds = 0.05;

double probability_on(const DiscoveredLaw& law, int axis) {
  double total = 0.0, on_axis = 0.0;
  for (const ClassMember& m : law.ambiguous) {
    total += m.odds;
    on_axis += m.axis == axis ? m.odds : 0.0;
  }
  return total > 0.0 ? on_axis / total : 0.0;
}

// Whether another law of the axis is a function of the same quantities and no others: both are terms of a series.
bool in_a_series(const DiscoveredLaw& law, const std::vector<DiscoveredLaw>& all) {
  return std::any_of(all.begin(), all.end(), [&](const DiscoveredLaw& other) {
    return &other != &law && other.term.axis == law.term.axis &&
           other.term.expression.variables() == law.term.expression.variables();
  });
}

bool has_shadow(const DiscoveredLaw& law, const std::vector<DiscoveredLaw>& all) {
  return std::any_of(all.begin(), all.end(), [&](const DiscoveredLaw& weak) {
    return weak.term.axis != law.term.axis && weak.gain < shadow_share * law.gain &&
           probability_on(weak, law.term.axis) > shadow_odds;
  });
}

// A weak law has rivals for want of data. Rivals are in a class that leave less than 2 log 100 = 9.2 of the law's gain: of one of 20 sigma
// that is a fortieth, a quarter of what another plan may show.
constexpr double strong_gain = 400.0;

bool is_unsure(const std::vector<DiscoveredLaw>& all) {
  return all.size() == 1 && all.front().gain > strong_gain && all.front().carries_over < more_likely_than_not;
}

// Why the form of this axis is not known, empty where it is. `crowding`: what stands against it before the classes are looked at.
std::string why_unknown(int axis, const std::vector<DiscoveredLaw>& all, std::string crowding, double departure_rate) {
  if (!crowding.empty()) {
    return crowding;
  }
  int here = 0, unsure = 0;
  for (const DiscoveredLaw& law : all) {
    if (law.term.axis != axis) {
      continue;
    }
    if (law.departure_log_p < std::log(departure_rate)) {
      return "its form departs from the axis with " + law.departs_with;
    }
    if (law.in_step) {
      return "it keeps step with the turns; unequal dwells would tell";
    }
    if (law.lack_log_p < std::log(departure_rate)) {
      return "positions and turns show more on the axis than it";
    }
    if (law.overlap > largest_overlap) {
      return "it and another of the axis do each other's work";
    }
    if (in_a_series(law, all)) {
      return "it and another of the axis follow the same quantities: terms of one law";
    }
    if (has_shadow(law, all)) {
      return "a much weaker one may as well be of this axis";
    }
    ++here;
    unsure += law.carries_over < more_likely_than_not ? 1 : 0;
  }
  return here == 1 || unsure == 0 ? "" : "one of the axis' two more probably fails elsewhere";
}

std::string crowding(int axis, std::span<const LawTerm> terms, std::span<const double> gains,
                     std::span<const DiscoveredProcess> processes) {
  double least = 0.0, most = 0.0;
  int here = 0;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    if (terms[k].axis == axis) {
      least = here == 0 ? gains[k] : std::min(least, gains[k]);
      most = std::max(most, gains[k]);
      ++here;
    }
  }
  if (std::any_of(processes.begin(), processes.end(), [&](const DiscoveredProcess& p) { return p.axis == axis; })) {
    return "the axis needs a random process beside it";
  }
  if (here > 2) {
    return "more than two equations share the axis";
  }
  return here == 2 && least <= comparable * most ? "one of the axis' two does less than half the other" : "";
}

}  // namespace

bool is_crowded(int axis, std::span<const LawTerm> terms, std::span<const double> gains,
                std::span<const DiscoveredProcess> processes) {
  return !crowding(axis, terms, gains, processes).empty();
}

double overlap_on_axis(std::span<const LawRecording> recordings, const LawFit& fit, int axis,
                       const std::stop_token& stop) {
  std::vector<LawTerm> elsewhere;
  double each = 0.0;
  for (std::size_t k = 0; k < fit.terms.size(); ++k) {
    if (fit.terms[k].axis == axis) {
      each += fit.gain[k];
    } else {
      elsewhere.push_back(fit.terms[k]);
    }
  }
  if (fit.terms.size() < elsewhere.size() + 2) {
    return 0.0;
  }
  const double without =
      elsewhere.empty() ? fit.square_before : fit_laws(recordings, elsewhere, constant_rounds, stop).square_after;
  return 1.0 - each / (without - fit.square_after);
}

TellingLaws tell_laws(std::vector<DiscoveredLaw> laws, std::span<const DiscoveredProcess> processes,
                      double departure_rate) {
  std::vector<LawTerm> terms;
  std::vector<double> gains;
  for (const DiscoveredLaw& law : laws) {
    terms.push_back(law.term);
    gains.push_back(law.gain);
  }
  std::array<std::string, axis_count> why;
  double unknown = 0.0;
  for (const DiscoveredLaw& law : laws) {
    std::string& of_axis = why[static_cast<std::size_t>(law.term.axis)];
    of_axis = why_unknown(law.term.axis, laws, crowding(law.term.axis, terms, gains, processes), departure_rate);
    unknown = of_axis.empty() ? unknown : std::max(unknown, law.gain);
  }
  TellingLaws result;
  if (is_unsure(laws) && why[static_cast<std::size_t>(laws.front().term.axis)].empty()) {
    laws.front().unsure = true;
    laws.front().why = "none of its class holds on another plan more probably than not";
    result.described = std::move(laws);
    return result;
  }
  for (DiscoveredLaw& law : laws) {
    law.why = why[static_cast<std::size_t>(law.term.axis)];
    if (law.why.empty() && law.gain <= unknown) {
      law.why = "it may be what a stronger described one lacks";
    }
    (law.why.empty() ? result.told : result.described).push_back(std::move(law));
  }
  return result;
}

}  // namespace selfcal::discovery
