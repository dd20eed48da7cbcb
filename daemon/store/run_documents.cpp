#include "daemon/store/run_documents.hpp"

#include <nlohmann/json.hpp>

#include "daemon/host/wall_clock.hpp"
#include "daemon/store/parameter_trend.hpp"
#include "daemon/store/run_summary.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/ins_interface/coefficients.hpp"

namespace selfcal {
namespace {

using nlohmann::ordered_json;

ordered_json figure(double value) { return value < 0 ? ordered_json() : ordered_json(value); }

Expected<ordered_json> heading(const RunStore& store, const RunRecord& run) {
  const auto undone = rolled_back_run(store, run);
  if (!undone) {
    return tl::unexpected(undone.error());
  }
  return ordered_json{
      {"run", run.id},
      {"ins", run.ins},
      {"serial", run.serial},
      {"state", name(run.state)},
      {"exit_status", run.exit_status < 0 ? ordered_json() : ordered_json(run.exit_status)},
      {"reason", run.reason},
      {"user", run.user},
      {"kind", run_kind(run)},
      {"source", run.source},
      {"amends", run.amends == 0 ? ordered_json() : ordered_json(run.amends)},
      {"amends_with", run.amends_with},
      {"rolls_back", *undone == 0 ? ordered_json() : ordered_json(*undone)},
      // Only a calibration turns the gimbal.
      {"schedule", run.rollback || run.amends != 0 ? std::string() : run.schedule},
      {"dry_run", run.dry_run},
      {"stop_when_met", run.stop_when_met},
      {"early_end_s", figure(run.early_end_s)},
      {"force_reason", run.force_reason},
      {"started_utc", run.started_utc},
      {"ended_utc", run.ended_utc},
      {"software", run.software},
      {"ins_software", run.ins_software},
      {"recording", run.recording},
      {"drift_before_m", figure(run.drift_old_m)},
      {"drift_after_m", figure(run.drift_new_m)},
  };
}

ordered_json text_or_null(const std::string& text) { return text.empty() ? ordered_json() : ordered_json(text); }

ordered_json in_force_json(const InForce& force) {
  return {{"now", force.now},
          {"known", force.known},
          {"from_utc", text_or_null(force.from_utc)},
          {"until_utc", text_or_null(force.until_utc)},
          {"ended_by_run", force.ended_by_run == 0 ? ordered_json() : ordered_json(force.ended_by_run)}};
}

// A coefficient record as it went over the bus, or null where there is none or it cannot be read.
Expected<ordered_json> set_document(const RunStore& store, RunId run, SetRole role) {
  const auto bytes = store.set(run, role);
  if (!bytes) {
    return tl::unexpected(bytes.error());
  }
  if (!*bytes) {
    return ordered_json();
  }
  const auto set = ins::decode_coefficients(**bytes);
  if (!set) {
    return ordered_json();
  }
  ordered_json parameters = ordered_json::array();
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const SensorParameter& parameter = sensor_parameters[i];
    parameters.push_back(
        {{"name", parameter.name}, {"unit", parameter.unit}, {"value", set->value[i] / parameter.si_per_unit}});
  }
  return ordered_json{{"version", set->version},
                      {"date_utc", utc_text(set->date_s)},
                      {"author", set->author},
                      {"parameters", std::move(parameters)}};
}

}  // namespace

Expected<std::string> run_document(const RunStore& store, const RunRecord& run) {
  auto head = heading(store, run);
  const auto force = in_force(store, run);
  if (!head || !force) {
    return tl::unexpected(head ? force.error() : head.error());
  }
  ordered_json document = document::with_head(document::run, *head);
  const ordered_json result =
      run.result_json.empty() ? ordered_json() : ordered_json::parse(run.result_json, nullptr, false);
  const RunId undone = document["rolls_back"].is_null() ? 0 : document["rolls_back"].get<RunId>();
  document["summary"] = summary_json(run_summary(run, *force, undone, result));
  document["in_force"] = in_force_json(*force);
  const auto events = store.events(run.id);
  if (!events) {
    return tl::unexpected(events.error());
  }
  document["events"] = ordered_json::array();
  for (const EventRecord& event : *events) {
    document["events"].push_back({{"utc", event.utc}, {"kind", event.kind}, {"text", event.text}});
  }
  ordered_json& sets = document["coefficients"];
  for (const auto& [key, role] :
       {std::pair{"previous", SetRole::previous}, {"proposed", SetRole::written}, {"read_back", SetRole::read_back}}) {
    auto set = set_document(store, run.id, role);
    if (!set) {
      return tl::unexpected(set.error());
    }
    sets[key] = std::move(*set);
  }
  // What the gate refused, or a dry run found, was proposed and never sent.
  sets["pushed"] = sets["read_back"].is_null() ? ordered_json() : sets["proposed"];
  sets["in_force"] = force->now;
  document["result"] = result;
  return document.dump();
}

Expected<std::string> history_document(const RunStore& store, const std::string& serial, const Limits& limits) {
  const auto runs = store.runs_of_serial(serial);
  if (!runs) {
    return tl::unexpected(runs.error());
  }
  ordered_json document = document::with_head(
      document::history, {{"serial", serial}, {"runs", ordered_json::array()}, {"parameters", ordered_json::array()}});
  for (const RunRecord& run : *runs) {
    auto head = heading(store, run);
    const auto force = in_force(store, run);
    if (!head || !force) {
      return tl::unexpected(head ? force.error() : head.error());
    }
    (*head)["in_force"] = in_force_json(*force);
    document["runs"].push_back(std::move(*head));
  }
  if (serial.empty()) {
    return document.dump();
  }
  for (int i = 0; i < sensor_parameter_count; ++i) {
    auto history = store.parameter_history(serial, i);
    if (!history) {
      return tl::unexpected(history.error());
    }
    const SensorParameter& parameter = sensor_parameters[static_cast<std::size_t>(i)];
    ordered_json values = ordered_json::array();
    for (const ParameterRecord& record : *history) {
      values.push_back({{"run", record.run},
                        {"utc", record.utc},
                        {"value", record.value},
                        {"sigma", record.sigma},
                        {"determined", record.determined}});
    }
    ordered_json entry{{"name", parameter.name}, {"unit", parameter.unit}, {"values", std::move(values)}};
    if (const auto trend = parameter_trend(*history)) {
      if (trend->slope_sigma > 0.0) {  // of values that lie long enough apart
        entry["change_per_year"] = trend->slope_per_year;
        entry["change_per_year_sigma"] = trend->slope_sigma;
      }
      entry["ageing"] = trend->ageing;
    }
    const double limit = limits[static_cast<std::size_t>(i)].value_or(0.0);
    entry["limit"] = limit > 0 ? ordered_json(limit) : ordered_json();
    entry["warnings"] = ordered_json::array();
    if (!history->empty()) {
      const ParameterRecord latest = history->back();
      history->pop_back();
      entry["warnings"] =
          trend_warnings(std::string(parameter.name), std::string(parameter.unit), *history, latest, limit);
    }
    document["parameters"].push_back(std::move(entry));
  }
  return document.dump();
}

}  // namespace selfcal
