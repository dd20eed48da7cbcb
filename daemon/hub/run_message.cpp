#include "daemon/hub/run_message.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/document/document_head.hpp"

namespace selfcal::hub {
namespace {

using Json = nlohmann::ordered_json;

std::string kind_of(const RunRecord& run) {
  if (run.rollback) {
    return "rollback";
  }
  if (run.dry_run) {
    return "dry_run";
  }
  return run.amends != 0 ? "amendment" : "calibration";
}

// Of this run alone; null where it has none.
Expected<Json> parameters_of(const Outbox& outbox, RunId run) {
  const auto parameters = outbox.parameters(run);
  if (!parameters) {
    return tl::unexpected(parameters.error());
  }
  if (!*parameters) {
    return Json();
  }
  Json list = Json::array();
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    list.push_back({{"name", sensor_parameters[i].name},
                    {"unit", sensor_parameters[i].unit},
                    {"value", (*parameters)->value[i]},
                    {"sigma", (*parameters)->sigma[i]},
                    {"determined", (*parameters)->determined[i]}});
  }
  return list;
}

Json finite_findings(const Json& result) {
  Json findings = Json::array();
  const Json* diagnosis = result.is_object() && result.contains("diagnosis") ? &result["diagnosis"] : nullptr;
  if (diagnosis == nullptr || !diagnosis->is_object() || !diagnosis->contains("findings")) {
    return findings;
  }
  for (const Json& finding : (*diagnosis)["findings"]) {
    Json parameters = Json::array();
    for (const Json& parameter : finding.value("parameters", Json::array())) {
      // A dimensionless share has the unit "1"; a sigma that is not known is no figure.
      if (parameter.value("value", Json()).is_number() && parameter.value("sigma", Json()).is_number()) {
        const std::string unit = parameter.value("unit", std::string());
        parameters.push_back({{"name", parameter.at("name")},
                              {"unit", unit.empty() ? "1" : unit},
                              {"value", parameter.at("value")},
                              {"sigma", parameter.at("sigma")}});
      }
    }
    findings.push_back({{"effect", finding.value("effect", std::string())}, {"parameters", std::move(parameters)}});
  }
  return findings;
}

}  // namespace

Expected<std::string> run_message(const RunStore& store, const Outbox& outbox, const RunRecord& run,
                                  const std::string& type, const std::optional<KeptRecording>& recording) {
  const Json result = run.result_json.empty() ? Json() : Json::parse(run.result_json, nullptr, false);
  auto parameters = parameters_of(outbox, run.id);
  const auto set = store.set(run.id, SetRole::written);
  if (!parameters || !set) {
    return tl::unexpected(parameters ? set.error() : parameters.error());
  }
  Json message = document::head({"selfcal.hub_run"});
  message["serial"] = run.serial;
  message["type"] = type;
  message["kind"] = kind_of(run);
  if (!run.source.empty()) {
    message["source"] = run.source;
  }
  message["state"] = name(run.state);
  message["started_utc"] = run.started_utc;
  message["ended_utc"] = run.ended_utc;
  message["software"] = run.software;
  message["exit_status"] = run.exit_status;
  message["reason"] = run.reason;
  message["operator"] = run.user;
  message["recording"] = recording ? Json{{"sha256", recording->sha256}, {"bytes", recording->bytes}} : Json();
  message["parameters"] = std::move(*parameters);
  std::string hexadecimal;
  for (const std::uint8_t byte : set->value_or(std::vector<std::uint8_t>())) {
    hexadecimal += fmt::format("{:02x}", byte);
  }
  message["coefficients"] = *set ? Json(hexadecimal) : Json();
  message["findings"] = finite_findings(result);
  message["result"] = result.is_discarded() ? Json() : result;
  // Words of a device may hold what is no UTF-8.
  return message.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace selfcal::hub
