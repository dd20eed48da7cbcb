#include "estimator/discovery/catalogue_reach.hpp"

#include <algorithm>
#include <numeric>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/discovery/column_shares.hpp"
#include "estimator/discovery/effect_columns.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {
namespace {

// Each effect of a sensor that may be seen on such a recording, at each value that its constant is tried at.
std::vector<EffectTerm> all_effects(bool has_temperature) {
  std::vector<EffectTerm> all;
  for (const diagnosis::Effect& effect : diagnosis::catalogue()) {
    if (effect.sensor != nullptr && diagnosis::applies(effect, has_temperature)) {
      for (const double constant : effect.constant.tried()) {
        all.push_back({&effect, constant, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(effect.parameters.size()))});
      }
    }
  }
  return all;
}

}  // namespace

CatalogueReach::CatalogueReach(const UnitRecording& recording, const std::vector<LawTerm>& laws,
                               const Eigen::VectorXd& coefficient, const std::stop_token& stop)
    : coefficient_(coefficient) {
  Scene scene(recording);
  scene.table = collect_nodes(scene.motion, scene.input);
  std::vector<EffectTerm> terms(recording.beside.begin(), recording.beside.end());
  const std::vector<EffectTerm> all = all_effects(scene.context.has_temperature());
  terms.insert(terms.end(), all.begin(), all.end());
  LawColumns of_laws(scene.motion, scene.table, laws, false);
  EffectColumns of_effects(scene.context, terms);
  TwoSources source(of_laws, of_effects);
  sums_ = run_columns(scene.input, scene.trace, source, stop);
  int at = of_laws.count();
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const EffectTerm& term = terms[k];
    std::vector<int> columns(static_cast<std::size_t>(term.count()));
    std::iota(columns.begin(), columns.end(), at);
    at += term.count();
    if (k < recording.beside.size()) {
      named_.insert(named_.end(), columns.begin(), columns.end());
    } else {
      variants_.push_back({term.effect, term.constant, std::move(columns)});
    }
  }
}

double CatalogueReach::gain_beside_named(std::vector<int> columns) const {
  columns.insert(columns.end(), named_.begin(), named_.end());
  return gain_of(sums_, columns) - gain_of(sums_, named_);
}

double CatalogueReach::share(const Variant& variant, const Eigen::VectorXd& signature) const {
  return 1.0 - share_beside(sums_, signature, variant.columns);
}

double CatalogueReach::share(const std::vector<bool>& in_place_of) const {
  Eigen::VectorXd signature = coefficient_;
  for (std::size_t k = 0; k < in_place_of.size(); ++k) {
    signature(static_cast<Eigen::Index>(k)) *= in_place_of[k] ? 1.0 : 0.0;
  }
  double largest = 0.0;
  if (signature.cwiseAbs().maxCoeff() > 0.0) {
    for (const Variant& variant : variants_) {
      largest = std::max(largest, share(variant, signature));
    }
  }
  return largest;
}

double CatalogueReach::largest_share(const diagnosis::Effect& effect) const {
  const auto laws = static_cast<std::size_t>(coefficient_.size());
  double largest = 0.0;
  for (std::size_t subset = 1; subset < std::size_t{1} << laws; ++subset) {
    Eigen::VectorXd signature = coefficient_;
    for (std::size_t k = 0; k < laws; ++k) {
      signature(static_cast<Eigen::Index>(k)) *= (subset >> k & 1U) != 0 ? 1.0 : 0.0;
    }
    for (const Variant& variant : variants_) {
      if (variant.effect == &effect) {
        largest = std::max(largest, share(variant, signature));
      }
    }
  }
  return largest;
}

std::vector<CatalogueReach::BesideOneLaw> CatalogueReach::beside_one_law() const {
  std::vector<BesideOneLaw> best;
  for (const Variant& variant : variants_) {
    for (int law = 0; law < static_cast<int>(coefficient_.size()); ++law) {
      std::vector<int> columns = variant.columns;
      columns.push_back(law);
      const double gain = gain_beside_named(columns);
      auto known = std::find_if(best.begin(), best.end(),
                                [&](const BesideOneLaw& b) { return b.effect.effect == variant.effect; });
      if (known != best.end() && known->gain >= gain) {
        continue;
      }
      if (known == best.end()) {
        known = best.insert(best.end(), BesideOneLaw{});
      }
      columns.insert(columns.end(), named_.begin(), named_.end());
      const Eigen::MatrixXd covariance =
          sums_.information(columns, columns).completeOrthogonalDecomposition().pseudoInverse();
      const auto sizes = static_cast<Eigen::Index>(variant.columns.size());
      *known = {{variant.effect, variant.constant, (covariance * sums_.score(columns)).head(sizes),
                 covariance.topLeftCorner(sizes, sizes)},
                gain,
                gain - gain_beside_named({law})};
    }
  }
  std::stable_sort(best.begin(), best.end(), [](const auto& a, const auto& b) { return a.gain > b.gain; });
  return best;
}

double CatalogueReach::gain_of_laws() const {
  std::vector<int> laws(static_cast<std::size_t>(coefficient_.size()));
  std::iota(laws.begin(), laws.end(), 0);
  return gain_beside_named(laws);
}

}  // namespace selfcal::discovery
