#include "daemon/estimate/gate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal {
namespace {

void add_parameter(std::vector<Objection>& found, const CalibrationResult& result, const ParameterVector& tolerance,
                   const Limits& limits, int k) {
  const SensorParameter& parameter = sensor_parameters[static_cast<std::size_t>(k)];
  const double value = result.value(k) / parameter.si_per_unit;
  const std::optional<double>& limit = limits[static_cast<std::size_t>(k)];
  if (!result.plausible[static_cast<std::size_t>(k)]) {
    found.push_back({ObjectionKind::implausible,
                     fmt::format("{} = {} {} is outside the physically possible range", parameter.name,
                                 number_text(value), parameter.unit),
                     k});
  }
  if (limit && !(std::abs(value) <= *limit)) {
    found.push_back({ObjectionKind::beyond_limit,
                     fmt::format("{} = {} {} is beyond the limit of {} {}", parameter.name, number_text(value),
                                 parameter.unit, number_text(*limit), parameter.unit),
                     k});
  }
  if (!result.determined[static_cast<std::size_t>(k)]) {
    found.push_back({ObjectionKind::undetermined,
                     fmt::format("{} not determined: sigma {} {}, tolerance {} {}", parameter.name,
                                 number_text(result.sigma(k) / parameter.si_per_unit), parameter.unit,
                                 number_text(tolerance(k) / parameter.si_per_unit), parameter.unit),
                     k});
  }
}

void add_consistency(std::vector<Objection>& found, const CalibrationResult& result) {
  const Consistency& consistency = result.consistency;
  if (consistency.verdict == Verdict::inconsistent) {
    found.push_back({ObjectionKind::inconsistent,
                     fmt::format("recording and model disagree: NIS {:.3f} where {:.3f} to {:.3f} is expected, "
                                 "innovations {}",
                                 consistency.nis_mean, consistency.nis_low, consistency.nis_high,
                                 whiteness_text(std::log(consistency.whiteness_p_value)))});
  } else if (consistency.verdict == Verdict::not_converged) {
    found.push_back({ObjectionKind::not_converged,
                     fmt::format("not converged after {} passes: the last moved a parameter by {} of its sigma",
                                 result.passes.size(),
                                 number_text(result.passes.empty() ? 0.0 : result.passes.back().largest_move_sigma))});
  }
}

Gate in_order(std::vector<Objection> found) {
  std::stable_sort(found.begin(), found.end(), [](const Objection& a, const Objection& b) { return a.kind < b.kind; });
  return {std::move(found)};
}

std::vector<Objection> all_of(const CalibrationResult& result, const ParameterVector& tolerance, const Limits& limits) {
  std::vector<Objection> found;
  add_consistency(found, result);
  for (int k = 0; k < sensor_parameter_count; ++k) {
    add_parameter(found, result, tolerance, limits, k);
  }
  return found;
}

}  // namespace

bool Gate::usable(int parameter) const {
  return std::none_of(objections.begin(), objections.end(),
                      [&](const Objection& o) { return o.parameter < 0 || o.parameter == parameter; });
}

std::vector<std::string> Gate::words() const {
  std::vector<std::string> all;
  for (const Objection& objection : objections) {
    all.push_back(objection.words);
  }
  return all;
}

Gate judge(const CalibrationResult& result, const ParameterVector& tolerance, const Limits& limits) {
  return in_order(all_of(result, tolerance, limits));
}

Gate judge_amended(const CalibrationResult& result, const ParameterVector& tolerance, const Limits& limits,
                   const diagnosis::Diagnosis& diagnosis, long long amends, const discovery::Discovery* beyond) {
  std::vector<Objection> found = all_of(result, tolerance, limits);
  for (const diagnosis::DataFault& fault : diagnosis.faults) {
    found.push_back({ObjectionKind::data_fault, fmt::format("data fault in run {}: {}", amends, fault.words)});
  }
  if (confirmed(beyond)) {
    return in_order(std::move(found));
  }
  if (diagnosis.unexplained && explains(beyond)) {
    found.push_back({ObjectionKind::unexplained,
                     fmt::format("run {} holds what no catalogue does: {}", amends, discovered_words(*beyond))});
  } else if (diagnosis.unexplained) {
    found.push_back(
        {ObjectionKind::unexplained,
         fmt::format("nothing in the catalogue explains run {}: {}", amends,
                     diagnosis.remaining.empty() ? "what remains is not white" : diagnosis.remaining.front().words)});
  } else if (diagnosis.model.empty()) {
    found.push_back(
        {ObjectionKind::nothing_to_amend, fmt::format("nothing to amend: no equation was named in run {}", amends)});
  }
  return in_order(std::move(found));
}

}  // namespace selfcal
