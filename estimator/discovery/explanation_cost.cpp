#include "estimator/discovery/explanation_cost.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace selfcal::discovery {
namespace {

// Twice the logarithm of the choices that one law is, a function and an axis out of half a million with their prior probabilities; and of a
// name out of the catalogue. The logarithm of the odds that it is known physics that stands beside unknown one lowers a name's.
constexpr double of_a_law = 24.0, of_a_name = 2.0;

double of_a_coefficient(double rows) { return std::log(std::max(2.0, rows)); }

}  // namespace

double cost_of_laws(std::size_t laws, double rows) {
  return (of_a_law + of_a_coefficient(rows)) * static_cast<double>(laws);
}

double cost_of_a_name(double rows) { return of_a_name + of_a_coefficient(rows); }

double cost_of_a_size(double draws) { return of_a_coefficient(draws); }

double cost_of_names(const std::vector<diagnosis::ModelEffect>& names, double rows) {
  constexpr double counts = 3.0;
  double cost = 0.0;
  for (const diagnosis::ModelEffect& name : names) {
    const Eigen::ArrayXd z = name.size.array().abs() / name.covariance.diagonal().array().sqrt();
    cost += of_a_name + of_a_coefficient(rows) * static_cast<double>(std::max<Eigen::Index>(1, (z > counts).count()));
  }
  return cost;
}

namespace {

diagnosis::Diagnosis without_those(diagnosis::Diagnosis d, const std::function<bool(const diagnosis::Effect*)>& name) {
  const auto kept = std::stable_partition(d.findings.begin(), d.findings.end(),
                                          [&](const diagnosis::Finding& f) { return !name(f.source); });
  if (kept != d.findings.end()) {
    d.open_beside_named.setZero();  // it was beside names that are not all there any more
  }
  d.rejected.insert(d.rejected.begin(), kept, d.findings.end());
  d.findings.erase(kept, d.findings.end());
  const auto modelled = std::stable_partition(d.model.begin(), d.model.end(),
                                              [&](const diagnosis::ModelEffect& m) { return !name(m.effect); });
  d.rejected_model.insert(d.rejected_model.begin(), modelled, d.model.end());
  d.model.erase(modelled, d.model.end());
  d.rejected_by_remains_alone = false;
  d.remainder.reset();
  d.verdict = d.model.empty() ? diagnosis::DiagnosisVerdict::none_of_the_above : diagnosis::DiagnosisVerdict::named;
  return d;
}

}  // namespace

diagnosis::Diagnosis without_names(diagnosis::Diagnosis d) {
  return without_those(std::move(d),
                       [](const diagnosis::Effect* effect) { return effect != nullptr && effect->sensor != nullptr; });
}

diagnosis::Diagnosis without_names(diagnosis::Diagnosis d, std::span<const diagnosis::Effect* const> names) {
  return without_those(std::move(d), [&](const diagnosis::Effect* effect) {
    return std::find(names.begin(), names.end(), effect) != names.end();
  });
}

diagnosis::Diagnosis with_rejected_names(diagnosis::Diagnosis d) {
  d.findings.insert(d.findings.begin(), d.rejected.begin(), d.rejected.end());
  d.rejected.clear();
  d.model.insert(d.model.end(), d.rejected_model.begin(), d.rejected_model.end());
  d.rejected_model.clear();
  return d;
}

}  // namespace selfcal::discovery
