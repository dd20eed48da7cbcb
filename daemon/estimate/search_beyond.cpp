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
    instead.laws.push_back({std::string(name_of_axis(term.axis)), term.expression.text(term.constants),
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

// Of names that stand alone: laws that are far likelier, in their place; others are kept in `d`.
std::optional<BeyondSearch> laws_in_their_place(const ImuData& data, Diagnosis& d,
                                                const discovery::DiscoveryOptions& of_laws,
                                                const discovery::Progress& progress) {
  constexpr double least_odds = 0.01, far_likelier = 10.0;
  const discovery::UnitRecording as_it_is{data, d.calibration};
  auto rivals = discovery::laws_for_names(as_it_is, d, std::log(least_odds), of_laws, progress);
  if (!rivals) {
    return std::nullopt;
  }
  if (rivals->log_odds < std::log(far_likelier)) {
    hold_both(d, rivals->search.fitted(), std::exp(rivals->log_odds));
    return std::nullopt;
  }
  const discovery::Discovery fitted = rivals->search.fitted();
  discovery::Discovery told = rivals->search.told();
  Diagnosis unnamed = discovery::without_names(d);
  unnamed.unexplained = unnamed.mismatch = true;
  const discovery::DiagnosedRecording recording{data, unnamed};
  auto rest = discovery::UnexplainedRest::of({&recording, 1}, of_laws.stop);
  if (!rest || told.laws.empty() || !explains(&told)) {
    hold_both(d, fitted, std::exp(rivals->log_odds));
    return std::nullopt;
  }
  d = std::move(unnamed);
  return BeyondSearch{std::move(*rest), std::move(told)};
}

}  // namespace

tl::expected<std::optional<BeyondSearch>, std::string> search_beyond(
    std::span<const discovery::DiagnosedRecording> unit, const diagnosis::DiagnosisOptions& of_catalogue,
    const discovery::DiscoveryOptions& of_laws, Diagnosis& first, Search when, const discovery::Progress& progress) {
  if (unit.size() == 1 && discovery::names_stand_alone(first)) {
    if (auto laws = laws_in_their_place(unit.front().data, first, of_laws, progress)) {
      return laws;
    }
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
