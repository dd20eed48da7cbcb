#include "estimator/discovery/names_beside_laws.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "estimator/discovery/catalogue_reach.hpp"
#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/guessed_laws.hpp"
#include "estimator/discovery/kept_names.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {
namespace {

using diagnosis::Diagnosis;
using diagnosis::ModelEffect;

double cost_in_words(const Discovery& found, const std::vector<ModelEffect>& names) {
  return cost_of_laws(found.fit.terms.size(), found.rows) + found.cost_of_processes + cost_of_names(names, found.rows);
}

// Each explanation has the noise that its own recording shows: what is left out widens it.
double cost_of(const Discovery& found, const std::vector<ModelEffect>& names) {
  return found.rows + found.misfit_after + found.log_determinant + cost_in_words(found, names);
}

std::size_t strongest_of(const LawFit& fit) {
  std::size_t strongest = 0;
  double most = 0.0;
  for (std::size_t k = 0; k < fit.terms.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double square = fit.coefficient(row) * fit.coefficient(row) / fit.covariance(row, row);
    strongest = square > most ? k : strongest;
    most = std::max(most, square);
  }
  return strongest;
}

bool has(const std::vector<ModelEffect>& names, const diagnosis::Effect* effect) {
  return std::any_of(names.begin(), names.end(), [effect](const ModelEffect& m) { return m.effect == effect; });
}

bool has_others(const std::vector<ModelEffect>& names, const std::vector<ModelEffect>& than) {
  return std::any_of(names.begin(), names.end(), [&](const ModelEffect& m) { return !has(than, m.effect); });
}

// What the catalogue says of a recording less some laws. Laws that were not fitted beside the names leave a part of themselves, for which the
// names may have been rejected.
struct Names {
  Diagnosis of_rest;
  bool rejected = false;
};

class Together {
 public:
  Together(const ImuData& data, const Diagnosis& diagnosis, const diagnosis::DiagnosisOptions& of_catalogue,
           const DiscoveryOptions& of_laws, const Progress& progress)
      : data_(data), diagnosis_(diagnosis), of_catalogue_(of_catalogue), of_laws_(of_laws), progress_(progress) {}

  // What the search finds beside this name and those that stand, fitted together with them. The name's size is that of a recording in which the
  // law is: what corrects it is no law.
  std::optional<FittedLaws> laws_beside(const ModelEffect& name) const {
    Diagnosis as_named = diagnosis_;
    as_named.model.push_back(name);
    as_named.findings.emplace_back().source = name.effect;
    const DiagnosedRecording recording{data_, as_named};
    const auto rest = UnexplainedRest::of({&recording, 1}, of_laws_.stop);
    if (!rest) {
      return std::nullopt;
    }
    const LawSearch search(rest->recordings(), of_laws_, progress_);
    if (!search.fitted().processes.empty()) {
      return std::nullopt;
    }
    const FittedLaws all = FittedLaws::fitted(search.fitted().fit);
    const std::vector<bool> made =
        made_by_effects(rest->recordings().front(), as_named.model, all.terms, of_laws_.stop);
    FittedLaws laws = all.where([&](std::size_t k) { return !made[k]; });
    if (laws.terms.empty()) {
      return std::nullopt;
    }
    const auto joint = rest->beside(laws.terms, laws.coefficient, of_laws_.stop);
    if (!joint) {
      return std::nullopt;
    }
    laws.coefficient = joint->shared.coefficient.head(laws.coefficient.size());
    return laws;
  }

  // What the catalogue says of the recording less these laws; none where it names nothing, not even what it rejects for nothing but what that
  // leaves. Of what it rejects for other things too, the names that stand already and those of `beside` alone, where these are all there.
  std::optional<Names> without(const FittedLaws& laws, const std::vector<const diagnosis::Effect*>& beside = {}) const {
    Scene scene({data_, diagnosis_.calibration});
    scene.table = collect_nodes(scene.motion, scene.input);
    const diagnosis::CorrectedRecording rest =
        without_laws(scene.motion, scene.table, scene.input, laws.terms, laws.coefficient);
    diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(rest.data(), of_catalogue_, progress_);
    if (!outcome.diagnosis) {
      return std::nullopt;
    }
    Diagnosis& d = *outcome.diagnosis;
    const bool rejected = d.rejected_by_remains_alone || (d.unexplained && kept_of_rejected(d, beside));
    if (rejected) {
      d = with_rejected_names(std::move(d));
    } else if (d.unexplained) {
      return std::nullopt;
    }
    if (d.model.empty() || (names_process(diagnosis_) && names_process(d))) {
      return std::nullopt;
    }
    return Names{std::move(d), rejected};
  }

  // Beside all equations that the catalogue rejected, or the strongest: two laws at most, and no process.
  std::optional<NamesBesideLaws> beside_rejected(const std::vector<ModelEffect>& rejected, double most_cost) const {
    constexpr std::size_t most_laws = 2;
    const ModelEffect* name = strongest(rejected);
    if (name == nullptr) {
      return std::nullopt;
    }
    std::vector<std::vector<ModelEffect>> choices = {rejected};
    if (rejected.size() > 1) {
      choices.push_back({*name});
    }
    for (const std::vector<ModelEffect>& names : choices) {
      if (of_laws_.stop.stop_requested()) {
        break;
      }
      Diagnosis named = diagnosis_;
      named.rejected_model = names;
      std::erase_if(named.rejected, [&](const diagnosis::Finding& f) { return !has(names, f.source); });
      auto both = answer(with_rejected_names(std::move(named)), most_laws, most_cost);
      if (both && both->laws.processes.empty()) {
        return both;
      }
    }
    return std::nullopt;
  }

  // The names of `of_rest` in the words of the recording's own diagnosis, with the laws found beside them: no more of them than
  // `most_laws`, names and laws cheaper than `most_cost`.
  std::optional<NamesBesideLaws> answer(const Diagnosis& of_rest, std::size_t most_laws, double most_cost) const {
    Diagnosis named = diagnosis_;
    named.findings = of_rest.findings;
    named.model = of_rest.model;
    named.remainder = of_rest.remainder;
    named.value = of_rest.value;
    named.sigma = of_rest.sigma;
    named.covariance = of_rest.covariance;
    named.value_as_named = of_rest.value_as_named;
    named.open_beside_named = of_rest.open_beside_named;
    named.rejected.clear();
    named.rejected_model.clear();
    if (names_process(diagnosis_)) {  // the laws stand in its place
      std::copy_if(diagnosis_.findings.begin(), diagnosis_.findings.end(), std::back_inserter(named.rejected),
                   [](const diagnosis::Finding& f) { return f.process; });
      named.unexplained = named.mismatch = true;
    }
    named.rejected_by_remains_alone = false;
    named.verdict = diagnosis::DiagnosisVerdict::named;
    const DiagnosedRecording recording{data_, named};
    auto rest = UnexplainedRest::of({&recording, 1}, of_laws_.stop);
    if (!rest) {
      return std::nullopt;
    }
    std::optional<LawSearch> search(std::in_place, rest->recordings(), of_laws_, progress_);
    if (took_out_too_little(*rest, search->fitted(), named)) {
      search.reset();
      rest = UnexplainedRest::of({&recording, 1}, of_laws_.stop);
      if (!rest) {
        return std::nullopt;
      }
      search.emplace(rest->recordings(), of_laws_, progress_);
    }
    fit_names(*rest, search->fitted(), named, of_laws_.stop);
    const auto stands = [&](const Discovery& found) {
      return found.fit.terms.size() <= most_laws && cost_of(found, named.model) < most_cost;
    };
    if (!stands(search->fitted())) {
      return std::nullopt;
    }
    Discovery laws = search->told();
    if ((laws.laws.empty() && laws.described.empty()) || !stands(laws)) {
      return std::nullopt;
    }
    return NamesBesideLaws{std::move(named), std::move(*rest), std::move(laws)};
  }

  // Names that were given before these laws were known may be bent by them: less what was found, the catalogue may have others that say less.
  std::optional<NamesBesideLaws> named_anew(const std::vector<ModelEffect>& before, const Discovery& found) const {
    const FittedLaws laws = FittedLaws::fitted(found.fit);
    if (laws.terms.empty() || !found.processes.empty()) {
      return std::nullopt;
    }
    const std::optional<Names> names = without(laws);
    if (!names || !has_others(names->of_rest.model, before)) {
      return std::nullopt;
    }
    return answer(names->of_rest, laws.terms.size(), cost_of(found, before));
  }

 private:
  // Laws that are what a name makes, with a constant of its own, on an axis where a law stood in its place: then the name is fitted anew beside
  // the others, in `named`, and the search is to be made again. The derivative by the constant, at a size of nothing, had left them.
  bool took_out_too_little(const UnexplainedRest& rest, const Discovery& fitted, Diagnosis& named) const {
    const FittedLaws all = FittedLaws::fitted(fitted.fit);
    if (all.terms.empty() || !fitted.processes.empty() || rest.effects().empty()) {
      return false;
    }
    constexpr double all_of_it = 0.98;
    std::vector<bool> own(all.terms.size(), false);
    for (std::size_t k = 0; k < own.size() && !of_laws_.stop.stop_requested(); ++k) {
      const auto may_make = [&](const UnitEffect& effect) {
        return (effect.effect->triad == diagnosis::Triad::gyro) == (all.terms[k].axis < 3) &&
               !std::isnan(effect.on.front().constant);
      };
      if (std::none_of(rest.effects().begin(), rest.effects().end(), may_make)) {
        continue;
      }
      const auto row = static_cast<Eigen::Index>(k);
      const CatalogueReach reach(rest.recordings().front(), {all.terms[k]}, all.coefficient.segment(row, 1),
                                 of_laws_.stop);
      own[k] = std::any_of(rest.effects().begin(), rest.effects().end(), [&](const UnitEffect& effect) {
        return may_make(effect) && reach.largest_share(*effect.effect) >= all_of_it;
      });
    }
    if (std::none_of(own.begin(), own.end(), [](bool is) { return is; })) {
      return false;
    }
    const FittedLaws others = all.where([&](std::size_t k) { return !own[k]; });
    const auto joint = rest.beside(others.terms, others.coefficient, of_laws_.stop);
    if (!joint) {
      return false;
    }
    adopt(*joint, named);
    named.remainder.reset();  // it was of a name without this axis
    return true;
  }

  // Whether the names that stand and these are rejected, which are all that is left of what is.
  bool kept_of_rejected(Diagnosis& d, const std::vector<const diagnosis::Effect*>& beside) const {
    const auto wanted = [&](const diagnosis::Effect* effect) {
      return has(diagnosis_.model, effect) || std::find(beside.begin(), beside.end(), effect) != beside.end();
    };
    const auto there = [&](const diagnosis::Effect* effect) { return has(d.rejected_model, effect); };
    const bool all = !beside.empty() && std::all_of(beside.begin(), beside.end(), there) &&
                     std::all_of(diagnosis_.model.begin(), diagnosis_.model.end(),
                                 [&](const ModelEffect& m) { return m.effect->sensor == nullptr || there(m.effect); });
    if (all) {
      std::erase_if(d.rejected_model, [&](const ModelEffect& m) { return !wanted(m.effect); });
      std::erase_if(d.rejected, [&](const diagnosis::Finding& f) { return !wanted(f.source); });
    }
    return all;
  }

  const ImuData& data_;
  const Diagnosis& diagnosis_;
  const diagnosis::DiagnosisOptions& of_catalogue_;
  const DiscoveryOptions& of_laws_;
  const Progress& progress_;
};

}  // namespace

void fit_names(const UnexplainedRest& rest, const Discovery& fitted, Diagnosis& diagnosis,
               const std::stop_token& stop) {
  if (rest.effects().empty() || fitted.fit.terms.empty() || !fitted.processes.empty()) {
    return;
  }
  if (const auto joint = rest.beside(fitted.fit.terms, fitted.fit.coefficient, stop)) {
    adopt(*joint, diagnosis);
  }
}

std::optional<NamesBesideLaws> names_beside_laws(const ImuData& data, const Diagnosis& d, const UnitRecording& searched,
                                                 const Discovery& alone,
                                                 const diagnosis::DiagnosisOptions& of_catalogue,
                                                 const DiscoveryOptions& of_laws, const Progress& progress) {
  // A process that is named stands where the search has one too.
  const bool may_be_both = d.unexplained || (names_process(d) && alone.processes.empty());
  if (!may_be_both || (alone.fit.terms.size() < 2 && alone.processes.empty())) {
    return std::nullopt;
  }
  const Together together(data, d, of_catalogue, of_laws, progress);
  std::vector<ModelEffect> rejected;
  std::copy_if(d.rejected_model.begin(), d.rejected_model.end(), std::back_inserter(rejected),
               [](const ModelEffect& m) { return m.effect->sensor != nullptr; });
  const double least = std::max(0.0, alone.misfit_after) + cost_in_words(alone, d.model);
  const double most_cost = cost_of(alone, d.model);
  const FittedLaws laws_alone = FittedLaws::fitted(alone.fit);
  std::vector<LawGuess> tried;
  const LawGuesses guesses(
      searched, rejected, laws_alone,
      {.strongest_law = strongest_of(alone.fit), .processes = !alone.processes.empty(), .names = !d.model.empty()},
      [&](const ModelEffect& name) { return together.laws_beside(name); }, of_laws.stop);
  // Where the search finds more laws beside the names than were taken out, the names do not explain what stood in their place.
  const auto answered = [&](const FittedLaws& laws, const Diagnosis& of_rest) {
    auto both = together.answer(of_rest, laws.terms.size(), most_cost);
    const bool bent = both && FittedLaws::fitted(both->laws.fit).forms() != laws.forms();
    auto mended = bent ? together.named_anew(both->diagnosis.model, both->laws) : std::nullopt;
    return mended ? std::move(mended) : std::move(both);
  };
  const auto among = [&](const std::vector<LawGuesses::Guess>& those) -> std::optional<NamesBesideLaws> {
    std::vector<std::pair<FittedLaws, Diagnosis>> rejected_names;  // asked where no guess has names that stand
    for (const auto& made : those) {
      std::optional<LawGuess> guess = made();
      if (!guess || guess->laws.terms.empty() || of_laws.stop.stop_requested()) {
        continue;
      }
      const double cost = cost_of_laws(guess->laws.terms.size(), alone.rows);
      const bool known = std::any_of(tried.begin(), tried.end(), [&](const LawGuess& before) {
        return guess->laws.much_like(before.laws) && guess->beside == before.beside;
      });
      if (known || cost + cost_of_a_name(alone.rows) >= least) {
        continue;
      }
      tried.push_back(*guess);
      std::optional<Names> names = together.without(guess->laws, guess->beside);
      // Names that say more, beside the laws that were taken out, than the laws alone do are not looked at further, nor those that stand already.
      if (!names || !has_others(names->of_rest.model, d.model) ||
          cost + cost_of_names(names->of_rest.model, alone.rows) >= least) {
        continue;
      }
      if (names->rejected) {
        rejected_names.emplace_back(std::move(guess->laws), std::move(names->of_rest));
      } else if (auto both = answered(guess->laws, names->of_rest)) {
        return both;
      }
    }
    for (const auto& [laws, of_rest] : rejected_names) {
      if (auto both = of_laws.stop.stop_requested() ? std::nullopt : answered(laws, of_rest)) {
        return both;
      }
    }
    return std::nullopt;
  };
  for (const auto* those : {&guesses.choices(), &guesses.beside_best_effects()}) {
    if (auto both = among(*those)) {
      return both;
    }
  }
  // A process may stand for all of what is there.
  return d.model.empty() && !alone.processes.empty() ? together.beside_rejected(rejected, most_cost) : std::nullopt;
}

std::optional<NamesBesideLaws> named_anew(const ImuData& data, const Diagnosis& d, const Discovery& beside,
                                          const diagnosis::DiagnosisOptions& of_catalogue,
                                          const DiscoveryOptions& of_laws, const Progress& progress) {
  const bool any =
      std::any_of(d.model.begin(), d.model.end(), [](const ModelEffect& m) { return m.effect->sensor != nullptr; });
  return any ? Together(data, d, of_catalogue, of_laws, progress).named_anew(d.model, beside) : std::nullopt;
}

std::optional<NamesBesideLaws> laws_in_place_of_names(const ImuData& data, const Diagnosis& d,
                                                      const UnitRecording& searched, const Discovery& beside,
                                                      const DiscoveryOptions& of_laws, const Progress& progress) {
  const FittedLaws found = FittedLaws::fitted(beside.fit);
  if (!(d.unexplained || names_process(d)) || d.model.empty() || found.terms.empty()) {
    return std::nullopt;
  }
  CatalogueReach reach(searched, found.terms, found.coefficient, of_laws.stop);
  const bool in_reach = std::any_of(d.model.begin(), d.model.end(), [&](const ModelEffect& m) {
    return m.effect->sensor != nullptr && reach.largest_share(*m.effect) >= least_share_of_laws;
  });
  if (!in_reach || of_laws.stop.stop_requested()) {
    return std::nullopt;
  }
  Diagnosis unnamed = without_names(d);
  const DiagnosedRecording recording{data, unnamed};
  auto rest = UnexplainedRest::of({&recording, 1}, of_laws.stop);
  if (!rest) {
    return std::nullopt;
  }
  LawSearch search(rest->recordings(), of_laws, progress);
  const double most = cost_of(beside, d.model);
  const auto say_less = [&](const Discovery& laws) { return cost_of(laws, unnamed.model) < most; };
  if (search.fitted().fit.terms.empty() || !say_less(search.fitted())) {
    return std::nullopt;
  }
  Discovery laws = search.told();
  if (laws.laws.empty() || !say_less(laws)) {
    return std::nullopt;
  }
  return NamesBesideLaws{std::move(unnamed), std::move(*rest), std::move(laws)};
}

}  // namespace selfcal::discovery
