#include "daemon/estimate/search_beyond.hpp"

#include <cmath>
#include <utility>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/kept_names.hpp"
#include "estimator/discovery/laws_for_names.hpp"
#include "estimator/discovery/names_beside_laws.hpp"
#include "protocol/law_file/law_file.hpp"

namespace selfcal {

namespace {

using diagnosis::Diagnosis;
using diagnosis::LawsInstead;

// The 24 over both explanations.
void hold_both(Diagnosis& d, const discovery::Discovery& laws, double odds) {
  LawsInstead instead;
  for (std::size_t k = 0; k < laws.fit.terms.size(); ++k) {
    const discovery::LawTerm& term = laws.fit.terms[k];
    const auto row = static_cast<Eigen::Index>(k);
    instead.laws.push_back({term.axis, std::string(name_of_axis(term.axis)), term.expression.text(term.constants),
                            laws.fit.coefficient(row), std::sqrt(laws.fit.covariance(row, row))});
  }
  instead.odds = odds;
  const double weight = odds / (1.0 + odds);
  const auto& other = laws.fit.recordings.front();
  const ParameterVector apart = other.parameters - d.value;
  d.value += weight * apart;
  d.covariance += weight * (other.covariance - d.covariance) + weight * (1.0 - weight) * apart * apart.transpose();
  d.sigma = d.covariance.diagonal().cwiseSqrt();
  d.instead = std::move(instead);
}

// Of names that stand alone: laws that are far likelier, in their place; of one recording others are kept in `first`.
std::optional<BeyondSearch> laws_in_their_place(std::span<const discovery::DiagnosedRecording> unit, Diagnosis& first,
                                                const discovery::DiscoveryOptions& of_laws,
                                                const discovery::Progress& progress) {
  constexpr double least_odds = 0.01, far_likelier = 10.0;
  std::vector<discovery::UnitRecording> as_they_are;
  for (const discovery::DiagnosedRecording& r : unit) {
    as_they_are.push_back({r.data, r.diagnosis.calibration});
  }
  auto rivals = discovery::laws_for_names(unit, as_they_are, std::log(least_odds), of_laws, progress);
  if (!rivals) {
    return std::nullopt;
  }
  const discovery::Discovery fitted = rivals->search.fitted();  // telling takes it away
  if (rivals->log_odds >= std::log(far_likelier)) {
    std::vector<Diagnosis> unnamed;
    for (const discovery::DiagnosedRecording& r : unit) {
      unnamed.push_back(discovery::without_names(r.diagnosis));
      unnamed.back().unexplained = unnamed.back().mismatch = true;
    }
    std::vector<discovery::DiagnosedRecording> recordings;
    for (std::size_t r = 0; r < unit.size(); ++r) {
      recordings.push_back({unit[r].data, unnamed[r]});
    }
    discovery::Discovery told = rivals->search.told();
    auto rest = discovery::UnexplainedRest::of(recordings, of_laws.stop);
    if (rest && !told.laws.empty() && explains(&told)) {
      first = std::move(unnamed.front());
      return BeyondSearch{std::move(*rest), std::move(told)};
    }
  }
  if (unit.size() == 1) {
    hold_both(first, fitted, std::exp(rivals->log_odds));
  }
  return std::nullopt;
}

}  // namespace

tl::expected<std::optional<BeyondSearch>, std::string> search_beyond(
    std::span<const discovery::DiagnosedRecording> unit, const diagnosis::DiagnosisOptions& of_catalogue,
    const discovery::DiscoveryOptions& of_laws, Diagnosis& first, Search when, const discovery::Progress& progress) {
  if (auto laws = laws_in_their_place(unit, first, of_laws, progress)) {
    return laws;
  }
  const bool due = unit.size() > 1 || first.unexplained || may_be_a_law(first);
  if (when == Search::where_due && !due) {
    return std::nullopt;
  }
  auto rest = discovery::UnexplainedRest::of(unit, of_laws.stop);
  if (!rest) {
    return tl::unexpected(rest.error());
  }
  discovery::LawSearch search(rest->recordings(), of_laws, progress);
  if (unit.size() == 1) {
    if (auto both = discovery::names_beside_laws(unit.front().data, first, rest->recordings().front(), search.fitted(),
                                                 of_catalogue, of_laws, progress)) {
      first = std::move(both->diagnosis);
      return BeyondSearch{std::move(both->rest), std::move(both->laws)};
    }
    if (auto alone = discovery::laws_in_place_of_names(unit.front().data, first, rest->recordings().front(),
                                                       search.fitted(), of_laws, progress)) {
      replace_process(alone->diagnosis, alone->laws);
      if (alone->diagnosis.unexplained) {
        first = std::move(alone->diagnosis);
        return BeyondSearch{std::move(alone->rest), std::move(alone->laws)};
      }
    }
  }
  discovery::Discovery told = search.told();
  BeyondSearch answer{std::move(*rest), std::move(told)};
  replace_process(first, answer.found);
  if (unit.size() == 1 &&
      discovery::say_what_was_rejected(answer.rest.recordings().front(), first, answer.found, of_laws.stop)) {
    discovery::keep_rejected_names(first, answer.found);
    answer.said_by_catalogue = true;
  }
  return answer;
}

}  // namespace selfcal
