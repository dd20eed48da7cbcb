#include "tools/report/fleet_document.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/host/wall_clock.hpp"
#include "daemon/store/parameter_trend.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr double days_per_year = 365.2425;
constexpr double drift_sigma = 3.0;  // a slope beyond this is a drift
constexpr int look_ahead_weeks = 20 * 52;

std::string utc_of_year(double year) {
  return utc_text(static_cast<std::int64_t>(std::llround(year * days_per_year * 86400.0)));
}

// First time from `from` on at which |line| + sigmas * its sigma passes the limit.
std::optional<double> crossing(const ParameterTrend& trend, double limit, double from, double sigmas) {
  for (int week = 0; week < look_ahead_weeks; ++week) {
    const double year = from + week * 7.0 / days_per_year;
    if (std::abs(trend.at(year)) + sigmas * trend.sigma_at(year) > limit) {
      return year;
    }
  }
  return std::nullopt;
}

Json utc_or_null(const std::optional<double>& year) { return year ? Json(utc_of_year(*year)) : Json(); }

Json parameter_entry(const Json& past, double now) {
  std::vector<ParameterRecord> records;
  Json values = Json::array();
  for (const Json& value : past.at("values")) {
    ParameterRecord record;
    record.run = value.at("run").get<RunId>();
    record.utc = value.at("utc").get<std::string>();
    record.value = value.at("value").get<double>();
    record.sigma = value.at("sigma").get<double>();
    record.determined = value.at("determined").get<bool>();
    records.push_back(record);
    Json entry = value;
    entry["year"] = 1970.0 + year_of(record.utc);
    values.push_back(std::move(entry));
  }
  Json parameter = {{"name", past.at("name")},
                    {"unit", past.at("unit")},
                    {"values", std::move(values)},
                    {"limit", past.value("limit", Json())},
                    {"warnings", past.value("warnings", Json::array())},
                    {"drifts", false}};
  const auto trend = parameter_trend(records);
  if (!trend) {
    return parameter;
  }
  parameter["change_per_year"] = trend->slope_per_year;
  parameter["change_per_year_sigma"] = trend->slope_sigma;
  parameter["ageing"] = trend->ageing;
  parameter["drifts"] = trend->slope_sigma > 0.0 && std::abs(trend->slope_per_year) > drift_sigma * trend->slope_sigma;
  if (parameter["limit"].is_number()) {
    const double limit = parameter["limit"].get<double>();
    parameter["passes_limit_utc"] = utc_or_null(crossing(*trend, limit, now, 0.0));
    parameter["passes_limit_earliest_utc"] = utc_or_null(crossing(*trend, limit, now, 2.0));
  }
  return parameter;
}

// The last calibration that took effect, and the navigation drift that it measured.
void add_last(Json& unit, const Json& runs, const FleetOptions& options, double now) {
  Json last;
  for (const Json& run : runs) {
    const bool in_force =
        run.at("state") == "completed" && !run.at("dry_run").get<bool>() && run.at("kind") == "calibration";
    const auto started = run.at("started_utc").get<std::string>();
    if (in_force && (last.is_null() || last.at("started_utc").get<std::string>() < started)) {
      last = run;
    }
  }
  unit["last_run"] = last;
  unit["due_utc"] = Json();
  unit["due_in_days"] = Json();
  if (last.is_object()) {
    const double due = year_of(last.at("started_utc").get<std::string>()) + options.interval_days / days_per_year;
    unit["due_utc"] = utc_of_year(due);
    unit["due_in_days"] = std::round((due - now) * days_per_year);
  }
}

}  // namespace

Expected<Json> fleet_document(const std::vector<Json>& histories, const FleetOptions& options) {
  const double now = year_of(options.as_of_utc);
  if (now <= 0.0) {
    return fail(ErrorKind::usage, fmt::format("--as-of {}: not a time like 2026-11-21T00:00:00Z", options.as_of_utc));
  }
  Json document = {{"kind", "fleet"},
                   {"as_of_utc", options.as_of_utc},
                   {"as_of_year", 1970.0 + now},
                   {"interval_days", options.interval_days},
                   {"units", Json::array()}};
  for (const Json& history : histories) {
    Json unit = {{"serial", history.at("serial")}, {"runs", history.at("runs")}, {"parameters", Json::array()}};
    add_last(unit, history.at("runs"), options, now);
    for (const Json& past : history.at("parameters")) {
      unit["parameters"].push_back(parameter_entry(past, now));
    }
    document["units"].push_back(std::move(unit));
  }
  return document;
}

}  // namespace selfcal::report
