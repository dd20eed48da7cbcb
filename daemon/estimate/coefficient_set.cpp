#include "daemon/estimate/coefficient_set.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace selfcal {
namespace {

using Json = nlohmann::ordered_json;

Expected<double> finite_number(const Json& entry, const char* key, const std::string& where) {
  const auto found = entry.find(key);
  if (found == entry.end() || !found->is_number() || !std::isfinite(found->get<double>())) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: not a finite number", where, key));
  }
  return found->get<double>();
}

Expected<void> parse_parameter(const Json& entry, std::size_t k, CoefficientSet& set, const std::string& name) {
  const SensorParameter& parameter = sensor_parameters[k];
  const std::string where = fmt::format("{}: parameters[{}]", name, k);
  if (!entry.is_object() || entry.value("name", Json()) != Json(parameter.name) ||
      entry.value("unit", Json()) != Json(parameter.unit)) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: name {}, unit {} expected", where, parameter.name, parameter.unit));
  }
  const Expected<double> value = finite_number(entry, "value", where);
  if (!value) {
    return tl::unexpected(value.error());
  }
  const Expected<double> sigma = finite_number(entry, "sigma", where);
  if (!sigma) {
    return tl::unexpected(sigma.error());
  }
  const auto determined = entry.find("determined");
  if (determined == entry.end() || !determined->is_boolean()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: determined: neither true nor false", where));
  }
  set.value[k] = *value * parameter.si_per_unit;
  set.sigma[k] = *sigma * parameter.si_per_unit;
  set.determined[k] = determined->get<bool>();
  return {};
}

}  // namespace

CoefficientSet coefficient_set(const CalibrationResult& result, bool acceptable, std::string serial,
                               std::string computed_at_utc) {
  CoefficientSet set;
  set.serial = std::move(serial);
  set.computed_at_utc = std::move(computed_at_utc);
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    set.value[k] = result.value[static_cast<Eigen::Index>(k)];
    set.sigma[k] = result.sigma[static_cast<Eigen::Index>(k)];
    set.determined[k] = result.determined[k] && result.plausible[k];
  }
  set.acceptable = acceptable;
  return set;
}

std::array<double, sensor_parameter_count> merged_with_in_force(
    const CoefficientSet& set, const std::array<double, sensor_parameter_count>& in_force) {
  std::array<double, sensor_parameter_count> merged = in_force;
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    if (set.determined[k]) {
      merged[k] = set.value[k];
    }
  }
  return merged;
}

std::string coefficient_set_json(const CoefficientSet& set) {
  Json parameters = Json::array();
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    const SensorParameter& parameter = sensor_parameters[k];
    parameters.push_back({{"name", parameter.name},
                          {"unit", parameter.unit},
                          {"value", set.value[k] / parameter.si_per_unit},
                          {"sigma", set.sigma[k] / parameter.si_per_unit},
                          {"determined", set.determined[k]}});
  }
  const Json document = {{"serial", set.serial},
                         {"computed_at_utc", set.computed_at_utc},
                         {"acceptable", set.acceptable},
                         {"parameters", std::move(parameters)}};
  return document.dump();
}

Expected<CoefficientSet> parse_coefficient_set(const std::string& json, const std::string& name) {
  const Json document = Json::parse(json, nullptr, false);
  if (!document.is_object()) {
    return fail(ErrorKind::bad_input, name + ": not a JSON object");
  }
  CoefficientSet set;
  for (const auto& [key, to] : {std::pair{"serial", &set.serial}, {"computed_at_utc", &set.computed_at_utc}}) {
    const auto found = document.find(key);
    if (found == document.end() || !found->is_string()) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}: not a string", name, key));
    }
    *to = found->get<std::string>();
  }
  const auto acceptable = document.find("acceptable");
  if (acceptable == document.end() || !acceptable->is_boolean()) {
    return fail(ErrorKind::bad_input, name + ": acceptable: neither true nor false");
  }
  set.acceptable = acceptable->get<bool>();
  const auto parameters = document.find("parameters");
  if (parameters == document.end() || !parameters->is_array() || parameters->size() != sensor_parameter_count) {
    return fail(ErrorKind::bad_input, fmt::format("{}: parameters: {} entries expected", name, sensor_parameter_count));
  }
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    if (const auto parsed = parse_parameter((*parameters)[k], k, set, name); !parsed) {
      return tl::unexpected(parsed.error());
    }
  }
  return set;
}

}  // namespace selfcal
