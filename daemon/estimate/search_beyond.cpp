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
using discovery::far_likelier;

// The 24 over the names and what may stand in their place. Where that is far likelier and yet no explanation, neither is right: sigma
// holds both.
void average(Diagnosis& d, LawsInstead instead, const ParameterVector& value, const ParameterMatrix& covariance) {
  const double weight = instead.odds / (1.0 + instead.odds);
  const double spread = instead.odds >= far_likelier ? weight * weight : weight * (1.0 - weight);
  const ParameterVector apart = value - d.value;
  d.value += weight * apart;
  d.covariance += weight * (covariance - d.covariance) + spread * apart * apart.transpose();
  d.sigma = d.covariance.diagonal().cwiseSqrt();
  d.instead = std::move(instead);
}

// Beside processes.
void hold_both(Diagnosis& d, LawsInstead instead, const discovery::Discovery& processes) {
  for (const discovery::DiscoveredProcess& p : processes.processes) {
    instead.laws.push_back(
        {p.axis, std::string(name_of_axis(p.axis)), {}, p.size, p.sigma, std::string(discovery::name_of(p.kind))});
  }
  average(d, std::move(instead), processes.average.parameters.front(), processes.average.covariance.front());
}

// Beside laws the names that stay are fitted anew.
void hold_both(Diagnosis& d, LawsInstead instead, const discovery::LawsForNames& rivals, const discovery::LawFit& fit,
               const std::stop_token& stop) {
  discovery::FittedRecording other = fit.recordings.front();
  Eigen::VectorXd coefficient = fit.coefficient;
  Eigen::MatrixXd of_coefficient = fit.covariance;
  if (!rivals.rest.effects().empty()) {
    const auto joint = rivals.rest.beside(fit.terms, fit.coefficient, stop);
    if (!joint) {
      return;
    }
    other.parameters = joint->shared.parameters.front();
    other.covariance = joint->shared.covariance.front();
    coefficient = joint->shared.coefficient;
    of_coefficient = joint->shared.coefficient_covariance;
  }
  for (std::size_t k = 0; k < fit.terms.size(); ++k) {
    const discovery::LawTerm& term = fit.terms[k];
    const auto row = static_cast<Eigen::Index>(k);
    instead.laws.push_back({term.axis, std::string(name_of_axis(term.axis)), term.expression.text(term.constants),
                            coefficient(row), std::sqrt(of_coefficient(row, row))});
  }
  average(d, std::move(instead), other.parameters, other.covariance);
}

// Of names that stand alone: laws or processes that are far likelier, in the place of some or all of them; of one recording others are kept in
// `first`.
std::optional<BeyondSearch> laws_in_their_place(std::span<const discovery::DiagnosedRecording> unit, Diagnosis& first,
                                                const discovery::DiscoveryOptions& of_laws,
                                                const discovery::Progress& progress) {
  constexpr double least_odds = 0.01;
  auto rivals = discovery::laws_for_names(unit, std::log(least_odds), of_laws, progress);
  if (!rivals) {
    return std::nullopt;
  }
  const discovery::LawFit fit = rivals->search.fitted().fit;  // telling takes it away
  const bool processes = fit.terms.empty(), likelier = rivals->log_odds >= std::log(far_likelier);
  const bool kept = unit.size() == 1;
  std::optional<discovery::Discovery> told;
  if (likelier || (processes && kept)) {
    told = rivals->search.told();
  }
  const bool beside = rivals->names.empty();  // all names stay, and laws are told with them
  if (likelier && !rivals->own_form && (beside || explains(&*told))) {
    first = std::move(rivals->without.front());
    first.unexplained = first.mismatch = true;
    return BeyondSearch{std::move(rivals->rest), std::move(*told)};
  }
  LawsInstead instead{{}, rivals->names, std::exp(rivals->log_odds)};
  if (kept && processes) {
    hold_both(first, std::move(instead), *told);
  } else if (kept) {
    hold_both(first, std::move(instead), *rivals, fit, of_laws.stop);
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
  const bool due = unit.size() > 1 || first.unexplained || discovery::names_process(first);
  if (when == Search::where_due && !due) {
    return std::nullopt;
  }
  auto rest = discovery::UnexplainedRest::of(unit, of_laws.stop);
  if (!rest) {
    return tl::unexpected(rest.error());
  }
  discovery::LawSearch search(rest->recordings(), of_laws, progress);
  if (unit.size() == 1) {
    Diagnosis fitted = first;
    discovery::fit_names(*rest, search.fitted(), fitted, of_laws.stop);
    auto both = discovery::names_beside_laws(unit.front().data, fitted, rest->recordings().front(), search.fitted(),
                                             of_catalogue, of_laws, progress);
    if (both && (first.unexplained || (both->laws.processes.empty() && explains(&both->laws)))) {
      // Beside the names that stand now a law may be one more.
      if (auto more = discovery::names_beside_laws(unit.front().data, both->diagnosis, both->rest.recordings().front(),
                                                   both->laws, of_catalogue, of_laws, progress)) {
        both = std::move(more);
      }
      first = std::move(both->diagnosis);
      return BeyondSearch{std::move(both->rest), std::move(both->laws)};
    }
    if (auto alone = discovery::laws_in_place_of_names(unit.front().data, fitted, rest->recordings().front(),
                                                       search.fitted(), of_laws, progress)) {
      replace_process(alone->diagnosis, alone->laws);
      if (alone->diagnosis.unexplained) {
        first = std::move(alone->diagnosis);
        return BeyondSearch{std::move(alone->rest), std::move(alone->laws)};
      }
    }
    if (auto anew =
            discovery::named_anew(unit.front().data, fitted, search.fitted(), of_catalogue, of_laws, progress)) {
      first = std::move(anew->diagnosis);
      return BeyondSearch{std::move(anew->rest), std::move(anew->laws)};
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
