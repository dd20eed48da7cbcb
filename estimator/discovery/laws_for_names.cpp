#include "estimator/discovery/laws_for_names.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/held_names.hpp"

namespace selfcal::discovery {
namespace {

std::vector<std::size_t> all_of(const std::vector<LawTerm>& laws) {
  std::vector<std::size_t> all(laws.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

// Each effect once, as the recording has it that shows it best: one unit has one physics.
std::vector<diagnosis::ModelEffect> names_of(std::span<const DiagnosedRecording> unit) {
  std::vector<diagnosis::ModelEffect> all;
  for (const DiagnosedRecording& r : unit) {
    for (const diagnosis::ModelEffect& name : r.diagnosis.model) {
      const auto same = std::find_if(all.begin(), all.end(), [&](const auto& m) { return m.effect == name.effect; });
      if (same == all.end()) {
        all.push_back(name);
      } else if (square_of(name) > square_of(*same)) {
        *same = name;
      }
    }
  }
  return all;
}

// Names that laws may replace together, and twice the logarithm of the odds that one law has at most.
struct Choice {
  std::vector<bool> out;
  double most = 0.0;
};

class NamesAgainstLaws {
 public:
  NamesAgainstLaws(std::span<const DiagnosedRecording> unit, const UnexplainedRest& less,
                   const DiscoveryOptions& of_laws, const Progress& progress)
      : unit_(unit), of_laws_(of_laws), progress_(progress), held_(less, of_laws.stop, progress) {
    remainder_ =
        std::any_of(unit.begin(), unit.end(), [](const DiagnosedRecording& r) { return r.diagnosis.remainder; });
    const std::vector<diagnosis::ModelEffect> all = names_of(unit);
    for (const diagnosis::Effect* name : held_.names()) {
      models_.push_back(
          *std::find_if(all.begin(), all.end(), [&](const diagnosis::ModelEffect& m) { return m.effect == name; }));
    }
  }

  // Each name alone, any two of a few, all together, and those that laws may replace one by one; of one recording none as well, where a law
  // beside all of them is far likelier. Most probable first.
  std::vector<Choice> choices(double least) {
    constexpr std::size_t most_for_pairs = 4;
    const std::size_t n = models_.size();
    std::vector<Choice> all;
    const auto add = [&](std::vector<bool> out) {
      const double most = most_of(out, least);
      all.push_back({std::move(out), most});
    };
    if (unit_.size() == 1) {
      add(std::vector<bool>(n, false));
      all.front().most = all.front().most < 2.0 * std::log(far_likelier) ? -HUGE_VAL : all.front().most;
    }
    for (std::size_t k = 0; k < n; ++k) {
      std::vector<bool> alone(n, false);
      alone[k] = true;
      add(alone);
      for (std::size_t other = 0; other < k && n <= most_for_pairs; ++other) {
        alone[other] = true;
        add(alone);
        alone[other] = false;
      }
    }
    if (n > 2) {
      add(std::vector<bool>(n, true));
    }
    if (auto one_by_one = replaced_one_by_one(all)) {
      all.push_back(std::move(*one_by_one));
    }
    std::erase_if(all, [&](const Choice& c) { return c.most < least; });
    std::stable_sort(all.begin(), all.end(), [](const Choice& a, const Choice& b) { return a.most > b.most; });
    return all;
  }

  std::optional<LawsForNames> search(const std::vector<bool>& out) const {
    std::vector<const diagnosis::Effect*> names;
    for (std::size_t k = 0; k < out.size(); ++k) {
      if (out[k]) {
        names.push_back(held_.names()[k]);
      }
    }
    std::vector<diagnosis::Diagnosis> without;
    for (const DiagnosedRecording& r : unit_) {
      without.push_back(without_names(r.diagnosis, names));
    }
    std::vector<DiagnosedRecording> recordings;
    for (std::size_t r = 0; r < unit_.size(); ++r) {
      recordings.push_back({unit_[r].data, without[r]});
    }
    auto rest = UnexplainedRest::of(recordings, of_laws_.stop);
    if (!rest) {
      return std::nullopt;
    }
    LawSearch search(rest->recordings(), of_laws_, progress_);
    const Discovery& found = search.fitted();
    const bool laws = !found.fit.terms.empty(), jumps = !found.processes.empty();
    if (laws == jumps || (jumps && beside_all(out)) || !may_replace(out, found) || of_laws_.stop.stop_requested()) {
      return std::nullopt;
    }
    const double ahead = jumps ? of_jumps(out, found)
                               : held_.beyond(out, found.fit.terms, {all_of(found.fit.terms)}).front() -
                                     dearer(out, found.fit.terms.size());
    const double log_odds = 0.5 * ahead;
    const bool own_form = std::any_of(found.fit.terms.begin(), found.fit.terms.end(),
                                      [&](const LawTerm& law) { return of_a_remainder(out, law.axis); });
    return LawsForNames{std::move(names), std::move(without), std::move(*rest), std::move(search), log_odds, own_form};
  }

  // In whose place `found` has laws.
  std::vector<bool> replaced(const LawsForNames& found) const {
    std::vector<bool> out;
    for (const diagnosis::Effect* name : held_.names()) {
      out.push_back(std::find(found.names.begin(), found.names.end(), name) != found.names.end());
    }
    return out;
  }

  // Which of the names in whose place `found` has laws go all the same, where the others are told again and of the laws those beside them that
  // are worth it; twice the logarithm of the odds against all the names. A law that is not worth it beside a name stood for a part of it.
  std::optional<Choice> with_names_again(const LawsForNames& found) const {
    const std::vector<LawTerm>& laws = found.search.fitted().fit.terms;
    const std::vector<bool> out = replaced(found);
    if (laws.empty()) {
      return std::nullopt;
    }
    std::optional<Choice> best;
    const auto look_at = [&](const std::vector<bool>& some) {
      const double most = best_of(some, laws);
      if (most > std::max(2.0 * found.log_odds, best ? best->most : 0.0)) {
        best.emplace(Choice{some, most});
      }
    };
    look_at(std::vector<bool>(out.size(), false));
    for (std::size_t k = 0; k < out.size() && std::count(out.begin(), out.end(), true) > 1; ++k) {
      if (out[k]) {
        std::vector<bool> some = out;
        some[k] = false;
        look_at(some);
      }
    }
    return best;
  }

  // The names in whose place `found` has laws, and those that stay and of which nothing is left when all is fitted together with the laws;
  // none where there are no such.
  std::optional<std::vector<bool>> with_the_empty(const LawsForNames& found) const {
    if (found.rest.effects().empty()) {
      return std::nullopt;
    }
    const LawFit& fit = found.search.fitted().fit;
    const auto joint = found.rest.beside(fit.terms, fit.coefficient, of_laws_.stop);
    if (!joint) {
      return std::nullopt;
    }
    std::vector<bool> out;
    bool more = false;
    for (const diagnosis::Effect* name : held_.names()) {
      const bool empty = std::any_of(joint->effects.begin(), joint->effects.end(),
                                     [name](const FittedEffect& e) { return e.effect == name && e.nothing_left(); });
      more = more || empty;
      out.push_back(empty);
    }
    const std::vector<bool> before = replaced(found);
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] = out[k] || before[k];
    }
    return more ? std::optional(std::move(out)) : std::nullopt;
  }

 private:
  // Twice the logarithm of the odds of those among these laws that are worth it in the place of the names that are out.
  double best_of(const std::vector<bool>& out, const std::vector<LawTerm>& laws) const {
    std::vector<std::vector<std::size_t>> choices(1);  // all: without each law, and with it
    for (std::size_t law = 0; law < laws.size(); ++law) {
      for (std::size_t k = 0, n = choices.size(); k < n; ++k) {
        choices.push_back(choices[k]);
        choices.back().push_back(law);
      }
    }
    const std::vector<double> beyond = held_.beyond(out, laws, choices);
    double best = -HUGE_VAL;
    for (std::size_t k = 0; k < choices.size(); ++k) {
      best = std::max(best, beyond[k] - dearer(out, choices[k].size()));
    }
    return best;
  }
  static bool beside_all(const std::vector<bool>& out) { return std::find(out.begin(), out.end(), true) == out.end(); }
  double most_of(const std::vector<bool>& out, double least) {
    const double more = dearer(out, 1);
    const auto allowed = [&](int axis) { return may_replace(out, axis); };
    const double of_a_law = held_.most_beyond(out, least + more, allowed) - more;
    return beside_all(out) ? of_a_law : std::max(of_a_law, held_.jumps_beyond(out, allowed) - dearer(out, 0));
  }
  // Twice the logarithm of the odds of the processes that were found.
  double of_jumps(const std::vector<bool>& out, const Discovery& found) const {
    const double cost =
        found.cost_of_processes + static_cast<double>(found.processes.size()) * cost_of_a_size(held_.dwells());
    return found.misfit_before - found.misfit_after - cost - held_.by_names(out) - dearer(out, 0);
  }
  // What was found: laws, or jumps at turns; a walk the catalogue has asked for.
  bool may_replace(const std::vector<bool>& out, const Discovery& found) const {
    return std::all_of(found.fit.terms.begin(), found.fit.terms.end(),
                       [&](const LawTerm& law) { return may_replace(out, law.axis); }) &&
           std::all_of(found.processes.begin(), found.processes.end(), [&](const DiscoveredProcess& process) {
             return process.kind == ProcessKind::jump_per_turn && may_replace(out, process.axis);
           });
  }
  // Whether a law of this axis may stand in the place of these names, or beside all of them. Beside a name with a remainder one of its own triad
  // is that remainder.
  bool may_replace(const std::vector<bool>& out, int axis) const {
    return !beside_all(out) || !of_a_remainder(std::vector<bool>(out.size(), true), axis);
  }
  // Whether it may be the true form of one of these names, which leaves a remainder.
  bool of_a_remainder(const std::vector<bool>& out, int axis) const {
    const diagnosis::Triad own = axis < 3 ? diagnosis::Triad::gyro : diagnosis::Triad::accelerometer;
    for (std::size_t k = 0; remainder_ && k < out.size(); ++k) {
      if (out[k] && models_[k].effect->triad == own) {
        return true;
      }
    }
    return false;
  }
  // Of choices of one name those that a law most probably replaces: a law each.
  std::optional<Choice> replaced_one_by_one(const std::vector<Choice>& all) const {
    Choice together{std::vector<bool>(models_.size(), false), 0.0};
    int names = 0;
    for (const Choice& c : all) {
      if (c.most > 0.0 && std::count(c.out.begin(), c.out.end(), true) == 1) {
        together.out[static_cast<std::size_t>(std::find(c.out.begin(), c.out.end(), true) - c.out.begin())] = true;
        together.most += c.most;
        ++names;
      }
    }
    return names > 1 ? std::optional(std::move(together)) : std::nullopt;
  }
  // By how much more laws cost than these names.
  double dearer(const std::vector<bool>& out, std::size_t laws) const {
    std::vector<diagnosis::ModelEffect> names;
    for (std::size_t k = 0; k < out.size(); ++k) {
      if (out[k]) {
        names.push_back(models_[k]);
      }
    }
    return cost_of_laws(laws, held_.rows()) - cost_of_names(names, held_.rows());
  }

  std::span<const DiagnosedRecording> unit_;
  const DiscoveryOptions& of_laws_;
  const Progress& progress_;
  HeldNames held_;
  bool remainder_ = false;                      // a name leaves one
  std::vector<diagnosis::ModelEffect> models_;  // [names]
};

}  // namespace

bool names_stand_alone(const diagnosis::Diagnosis& d) {
  const bool of_sensor = std::any_of(d.model.begin(), d.model.end(),
                                     [](const diagnosis::ModelEffect& m) { return m.effect->sensor != nullptr; });
  return d.verdict == diagnosis::DiagnosisVerdict::named && d.faults.empty() && of_sensor && !names_process(d) &&
         !d.unexplained;
}

std::optional<LawsForNames> laws_for_names(std::span<const DiagnosedRecording> unit, double least_log_odds,
                                           const DiscoveryOptions& of_laws, const Progress& progress) {
  const auto stands = [](const DiagnosedRecording& r) { return names_stand_alone(r.diagnosis); };
  const auto explained = [&](const DiagnosedRecording& r) {
    return stands(r) || r.diagnosis.verdict == diagnosis::DiagnosisVerdict::adequate;
  };
  if (!std::any_of(unit.begin(), unit.end(), stands) || !std::all_of(unit.begin(), unit.end(), explained)) {
    return std::nullopt;
  }
  const auto less_names = UnexplainedRest::of(unit, of_laws.stop);
  if (!less_names || less_names->effects().empty()) {
    return std::nullopt;
  }
  NamesAgainstLaws against(unit, *less_names, of_laws, progress);
  constexpr int most_searches = 3;
  std::optional<LawsForNames> best;
  int searches = 0;
  for (const Choice& choice : against.choices(2.0 * least_log_odds)) {
    if (searches == most_searches || (best && choice.most <= 2.0 * best->log_odds) || of_laws.stop.stop_requested()) {
      break;
    }
    ++searches;
    auto found = against.search(choice.out);
    const double least = found && found->names.empty() ? std::log(far_likelier) : least_log_odds;
    if (found && found->log_odds >= least && (!best || found->log_odds > best->log_odds)) {
      best.emplace(std::move(*found));
    }
  }
  // What laws stand in the place of may be there beside some of them: a name that took up a law was right nevertheless.
  if (const auto again =
          best && best->log_odds >= std::log(far_likelier) ? against.with_names_again(*best) : std::nullopt) {
    auto found = against.search(again->out);
    if (found && found->log_odds > best->log_odds) {
      best.emplace(std::move(*found));
    }
  }
  // A name with many coefficients gains by noise alone what makes it seem worth keeping.
  if (const auto out = best ? against.with_the_empty(*best) : std::nullopt) {
    auto found = against.search(*out);
    if (found && found->log_odds >= least_log_odds) {
      best.emplace(std::move(*found));
    }
  }
  return best;
}

}  // namespace selfcal::discovery
