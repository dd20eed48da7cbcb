#include "estimator/diagnosis/search/judgement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rejection_rate = 0.01;  // of right names, by the biases that they leave
constexpr double remainder_rate = 0.01;  // and by map, whiteness and size

const std::array<const char*, 6> axis_letters = {"x", "y", "z", "x", "y", "z"};

// Beside an effect of hundreds of sigma the linearisation, and an equation that is right to 3 % of the amplitude, leave a
// thousandth of its square, in one place or in all: not worth a verdict.
bool negligible(const Adequacy& after, const Adequacy& before) {
  constexpr double worth_a_verdict = 1e-3, seen_anywhere = 16.0;  // 4 sigma, squared
  const double square = worth_a_verdict * before.misfit;
  return after.misfit < square && after.largest_sigma * after.largest_sigma < std::max(seen_anywhere, square);
}

// What was named must explain: where it makes most of what is seen it is held to more than a recording in which nothing was
// found. What it has no part in speaks neither for it nor against it.
bool structure_good(const Structure& left, const Rules& rules) {
  return left.log_p_named > std::log(rejection_rate) &&
         left.log_p_elsewhere > std::log(rules.budget.structure * rules.alpha);
}

// What is named, in words; processes that only jump apart from it.
void describe_all(const SearchResult& found, const Rules& rules, Judgement& j) {
  for (const NamedTerm& term : found.named) {
    j.named.push_back(describe(term, found.rows));
    j.named.back().share = term.delta_chi2 / found.misfit;
  }
  for (const BiasProcess& process : found.processes) {
    (rules.goes_on(process) ? j.named : j.jumps).push_back(describe(process, found.rows));
  }
  std::stable_sort(j.named.begin(), j.named.end(),
                   [](const Finding& a, const Finding& b) { return a.log_p < b.log_p; });
}

}  // namespace

Finding describe(const Suspect& suspect) {
  Finding f;
  f.source = suspect.effect;
  f.effect = suspect.effect->id;
  f.equation = suspect.effect->equation;
  f.experiment = suspect.effect->experiment;
  f.log_p = suspect.log_p;
  f.significance = sigma_from_log_p(suspect.log_p);
  return f;
}

std::vector<FindingParameter> finding_parameters(const Effect& effect, const Eigen::VectorXd& size,
                                                 const Eigen::VectorXd& sigma, double constant, double constant_sigma) {
  std::vector<FindingParameter> parameters;
  for (Eigen::Index k = 0; k < size.size(); ++k) {
    const EffectParameter& p = effect.parameters[static_cast<std::size_t>(k)];
    const double value = size(k) * p.typical;
    parameters.push_back({p.name, p.unit, value, sigma(k) * p.typical, effect.physics_prefix + p.name, value});
  }
  if (!std::isnan(constant)) {
    parameters.push_back({std::string(effect.constant.name), std::string(effect.constant.unit), constant,
                          constant_sigma, std::string(effect.constant.physics_key),
                          constant * effect.constant.physics_per_unit});
  }
  return parameters;
}

Finding describe(const NamedTerm& term, double rows) {
  const Effect& effect = *term.effect;
  Finding f;
  f.source = &effect;
  f.effect = effect.id;
  f.equation = effect.equation;
  f.excited = effect.excited;
  f.experiment = effect.experiment;
  f.parameters = finding_parameters(effect, term.amplitude, term.covariance.diagonal().cwiseSqrt(), term.constant,
                                    term.constant_sigma);
  f.equivalent = ids_of(term.equivalent);
  f.rivals = term.equivalent;
  for (const auto& [rival, p] : term.probability) {
    f.probability[rival->id] = p;
  }
  f.log_p = term.log_p;
  f.significance = sigma_from_log_p(term.log_p);
  f.delta_bic = term.delta_chi2 - term.rank * std::log(rows);
  f.held_out_gain = term.held_out;
  return f;
}

Finding describe(const BiasProcess& process, double rows) {
  const bool gyro = process.of_gyro(), walks = process.kernel.kind == BiasKernel::Kind::random_walk;
  const std::array<const char*, 2> ids = gyro ? std::array{"gyro_random_walk", "gyro_bias_instability"}
                                              : std::array{"accel_random_walk", "accel_bias_instability"};
  Finding f;
  f.effect = ids[walks ? 0 : 1];
  f.equation = walks ? "bias walks: variance grows with time" : "bias wanders: correlation exp(-t/tau)";
  f.excited = "whole recording";
  f.experiment = "a longer recording";
  const double unit = map_unit(process.axes.front()) / (gyro ? units::degree_per_hour : units::micro_g);
  const std::string unit_name = gyro ? "deg/h" : "ug";
  for (const int axis : process.axes) {
    f.parameters.push_back({axis_letters[static_cast<std::size_t>(axis)], walks ? unit_name + "/sqrt(h)" : unit_name,
                            process.size * unit, process.sigma * unit});
  }
  if (!walks) {
    f.parameters.push_back({"tau_s", "s", process.kernel.correlation_s, process.correlation_sigma_s});
  }
  constexpr double of_the_class = 0.01;
  if (process.probability_of_other_kind > of_the_class) {
    f.equivalent.emplace_back(ids[walks ? 1 : 0]);
  }
  f.probability = {{ids[walks ? 0 : 1], 1.0 - process.probability_of_other_kind},
                   {ids[walks ? 1 : 0], process.probability_of_other_kind}};
  f.log_p = process.log_p();
  f.significance = sigma_from_log_p(f.log_p);
  f.delta_bic = process.delta_chi2 - process.coefficients() * std::log(rows);
  f.process = f.stochastic = true;
  return f;
}

Adequacy adequacy(const Rules& rules, const Shown& shown, double rows, double alpha, double alpha_elsewhere) {
  Adequacy a;
  a.nis = shown.square / rows;
  a.log_p_white = shown.log_p_white;
  a.coloured = rules.coloured;
  a.largest_sigma = shown.map.largest_sigma;
  a.misfit = std::max(0.0, shown.square - rows);
  const auto good = [&](double sigma, double rate) {
    return log_corrected(log_normal_tail(sigma), std::max(1, shown.map.tests)) > std::log(rules.budget.map * rate);
  };
  const bool map_good =
      good(shown.map.largest_named_sigma, alpha) && good(shown.map.largest_sigma, std::min(alpha, alpha_elsewhere));
  // A fitted model of the base's motion leaves a little correlation; noise densities are known to 2 %: NIS to 4 %.
  const bool white = rules.motion_fitted || a.coloured || a.log_p_white > std::log(rules.budget.whiteness * alpha);
  const double nis_sigma = std::sqrt(2.0 / rows + 0.04 * 0.04);
  const bool size_good = rules.motion_fitted ||
                         log_normal_tail(std::max(0.0, a.nis - 1.0) / nis_sigma) > std::log(rules.budget.size * alpha);
  a.accepted = map_good && white && size_good;
  return a;
}

Judgement judge(const SearchResult& found, const Rules& rules) {
  Judgement j;
  j.before = adequacy(rules, found.before, found.rows, rules.alpha, rules.alpha);
  const double of_names = found.empty() ? rules.alpha : std::max(rules.alpha, remainder_rate);
  j.after = adequacy(rules, found.after, found.rows, of_names, rules.alpha);
  describe_all(found, rules, j);
  if (!rules.motion_fitted) {
    j.after.log_p_structure = found.structure.log_p();
    j.after.accepted = j.after.accepted && structure_good(found.structure, rules);
  }
  j.after.accepted = j.after.accepted || (!j.named.empty() && negligible(j.after, j.before));
  const bool itself = found.log_p_lack_of_fit > std::log(rejection_rate);
  j.after.accepted = j.after.accepted && j.jumps.empty() && itself && !found.collinear;
  j.names_stand = j.after.accepted || j.after.misfit < rules.tolerable_share * j.before.misfit;
  return j;
}

void write_down(const SearchResult& found, const Judgement& j, Diagnosis& d) {
  d.log_p_limit = found.log_p_limit;
  d.located = found.before.map.places;
  d.remaining = found.after.map.places;
  d.before = j.before;
  d.after = j.after;
  d.unexplained = !j.after.accepted;
  d.rejected = j.jumps;
  // A name that leaves something behind is the best fitting, not the truth, and no equation of a model: nothing of it is
  // carried over or taken out.
  std::vector<Finding>& destination = j.names_stand ? d.findings : d.rejected;
  destination.insert(destination.end(), j.named.begin(), j.named.end());
  std::vector<ModelEffect>& model = j.names_stand ? d.model : d.rejected_model;
  for (const NamedTerm& term : found.named) {
    model.push_back({term.effect, term.constant, term.amplitude, term.covariance});
  }
  d.rejected_by_remains_alone = !j.names_stand && j.jumps.empty() && found.processes.empty() && !found.collinear;
  d.value = found.value;
  d.value_as_named = found.value_as_named;
  d.covariance = found.covariance;
  if (!d.model.empty()) {
    d.open_beside_named = found.open_beside_named;
  }
  d.sigma = d.covariance.diagonal().cwiseSqrt();
}

DiagnosisVerdict verdict_of(bool named, bool unexplained, bool suspected) {
  return named         ? DiagnosisVerdict::named
         : unexplained ? DiagnosisVerdict::none_of_the_above
         : suspected   ? DiagnosisVerdict::not_enough_information
                       : DiagnosisVerdict::adequate;
}

}  // namespace selfcal::diagnosis
