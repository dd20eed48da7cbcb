#include "estimator/discovery/kept_names.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/discovery/column_shares.hpp"
#include "estimator/discovery/effect_columns.hpp"
#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {
namespace {

constexpr double most_beside = 0.02;  // of the laws' square, that the effects cannot make

std::vector<EffectTerm> terms_of(const std::vector<diagnosis::ModelEffect>& model) {
  std::vector<EffectTerm> terms;
  terms.reserve(model.size());
  for (const diagnosis::ModelEffect& effect : model) {
    terms.push_back({effect.effect, effect.constant, effect.size, !std::isnan(effect.constant)});
  }
  return terms;
}

// What laws make of the innovations of a recording, and what effects can.
class Made {
 public:
  Made(const UnitRecording& recording, const std::vector<diagnosis::ModelEffect>& model,
       const std::vector<LawTerm>& laws, const std::stop_token& stop)
      : laws_(laws.size()) {
    Scene scene(recording);
    scene.table = collect_nodes(scene.motion, scene.input);
    const std::vector<EffectTerm> terms = terms_of(model);
    LawColumns of_laws(scene.motion, scene.table, laws, false);
    EffectColumns of_effects(scene.context, terms);
    TwoSources source(of_laws, of_effects);
    sums_ = run_columns(scene.input, scene.trace, source, stop);
    std::iota(laws_.begin(), laws_.end(), 0);
    for (const EffectTerm& term : terms) {
      own_.emplace_back(static_cast<std::size_t>(term.count()));
      std::iota(own_.back().begin(), own_.back().end(), of_laws.count() + static_cast<int>(effects_.size()));
      effects_.insert(effects_.end(), own_.back().begin(), own_.back().end());
    }
  }

  // All but two per cent of law k.
  bool by(std::size_t effect, std::size_t k) const {
    const auto n = static_cast<Eigen::Index>(laws_.size());
    return share_beside(sums_, Eigen::VectorXd::Unit(n, static_cast<Eigen::Index>(k)), own_[effect]) < most_beside;
  }
  bool by_all(const Eigen::VectorXd& coefficient) const {
    return share_beside(sums_, coefficient, effects_) < most_beside;
  }
  double more_by_laws() const { return gain_of(sums_, laws_) - gain_of(sums_, effects_); }

 private:
  ColumnSums sums_;
  std::vector<int> laws_, effects_;
  std::vector<std::vector<int>> own_;  // columns of each effect
};

}  // namespace

std::vector<bool> made_by_effects(const UnitRecording& recording, const std::vector<diagnosis::ModelEffect>& model,
                                  const std::vector<LawTerm>& laws, const std::stop_token& stop) {
  std::vector<bool> made(laws.size(), false);
  if (laws.empty() || model.empty()) {
    return made;
  }
  const Made columns(recording, model, laws, stop);
  for (std::size_t k = 0; k < laws.size() && !stop.stop_requested(); ++k) {
    for (std::size_t effect = 0; effect < model.size(); ++effect) {
      made[k] = made[k] || columns.by(effect, k);
    }
  }
  return made;
}

bool say_what_was_rejected(const UnitRecording& recording, const diagnosis::Diagnosis& d, Discovery& found,
                           const std::stop_token& stop) {
  const auto of_a_sensor = [](const diagnosis::ModelEffect& e) { return e.effect->sensor != nullptr; };
  if (!d.unexplained || !d.rejected_by_remains_alone || d.rejected_model.empty() || found.laws.empty() ||
      !found.described.empty() || !std::all_of(d.rejected_model.begin(), d.rejected_model.end(), of_a_sensor)) {
    return false;
  }
  std::vector<LawTerm> told;
  Eigen::VectorXd coefficient(static_cast<Eigen::Index>(found.laws.size()));
  for (const DiscoveredLaw& law : found.laws) {
    coefficient(static_cast<Eigen::Index>(told.size())) = law.coefficient;
    told.push_back(law.term);
  }
  const Made columns(recording, d.rejected_model, told, stop);
  if (stop.stop_requested()) {
    return false;
  }
  for (std::size_t effect = 0; effect < d.rejected_model.size(); ++effect) {
    for (std::size_t k = 0; k < told.size(); ++k) {
      if (columns.by(effect, k)) {
        found.laws[k].effect = d.rejected_model[effect].effect->id;
      }
    }
  }
  const double chance = 2.0 * std::log(static_cast<double>(std::max<std::size_t>(1, found.functions_tried)));
  return found.processes.empty() && found.left && columns.by_all(coefficient) && columns.more_by_laws() < chance;
}

void keep_rejected_names(diagnosis::Diagnosis& d, const Discovery& found) {
  diagnosis::Remainder remainder;
  remainder.sigma = std::max(std::sqrt(std::max(0.0, found.misfit_after)), found.left->adequacy.largest_sigma);
  remainder.share = std::min(1.0, remainder.sigma * remainder.sigma / std::max(1.0, found.misfit_before));
  remainder.forms = {{d.rejected_model.front().effect->id, "its form departs from the equation", remainder.share}};
  remainder.places = found.left->places;
  d = with_rejected_names(std::move(d));
  d.remainder = std::move(remainder);
  d.after.accepted = true;
  d.unexplained = false;
  d.verdict = diagnosis::DiagnosisVerdict::named;
}

}  // namespace selfcal::discovery
