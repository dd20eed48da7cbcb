#include "tools/cli/report_hub.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/hub/hub_connection.hpp"
#include "daemon/store/parameter_trend.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr int calibrations_of_a_unit = 12;
constexpr double days_per_year = 365.2425;

std::string instant(const char* column) { return fmt::format("to_char({}, 'YYYY-MM-DD\"T\"HH24:MI:SS\"Z\"')", column); }

// A parameter by its type: limit of its size, null where there is none.
using Limits = std::map<std::pair<std::string, int>, double>;

Expected<Limits> limits_of(hub::Connection& connection) {
  return connection.ask("SELECT type, position, size FROM limits WHERE size IS NOT NULL")
      .map([](const hub::Rows& rows) {
        Limits limits;
        for (int row = 0; row < rows.size(); ++row) {
          limits[{rows.text(row, 0), static_cast<int>(rows.integer(row, 1))}] = rows.real(row, 2);
        }
        return limits;
      });
}

Json new_history(const std::string& serial, const std::string& type, const Limits& limits) {
  Json history = {{"serial", serial}, {"runs", Json::array()}, {"parameters", Json::array()}};
  int position = 0;
  for (const auto& parameter : sensor_parameters) {
    const auto limit = limits.find({type, ++position});
    history["parameters"].push_back({{"name", parameter.name},
                                     {"unit", parameter.unit},
                                     {"values", Json::array()},
                                     {"limit", limit == limits.end() ? Json() : Json(limit->second)},
                                     {"warnings", Json::array()}});
  }
  return history;
}

void add_calibration(Json& history, const hub::Rows& rows, int row) {
  const std::int64_t run = rows.integer(row, 3);
  const std::string utc = rows.text(row, 4);
  history["runs"].push_back({{"run", run},
                             {"ins", rows.text(row, 2)},
                             {"serial", rows.text(row, 0)},
                             {"state", "completed"},
                             {"kind", "calibration"},
                             {"dry_run", false},
                             {"started_utc", utc},
                             {"drift_before_m", Json()},
                             {"drift_after_m", Json()}});
  const auto value = rows.reals(row, 5), sigma = rows.reals(row, 6);
  const std::string determined = rows.text(row, 7);  // "{t,f,...}"
  for (std::size_t i = 0; i < history["parameters"].size() && i < value.size() && i < sigma.size(); ++i) {
    history["parameters"][i]["values"].push_back({{"run", run},
                                                  {"utc", utc},
                                                  {"value", value[i]},
                                                  {"sigma", sigma[i]},
                                                  {"determined", determined.at(1 + 2 * i) == 't'}});
  }
}

Expected<std::vector<Json>> histories_of(hub::Connection& connection) {
  const auto limits = limits_of(connection);
  if (!limits) {
    return tl::unexpected(limits.error());
  }
  const auto rows = connection.ask(fmt::format(
      "SELECT u.serial, u.type, c.set_name, r.run, {}, c.value::double precision[], c.sigma::double precision[], "
      "c.determined::boolean[] FROM units u, LATERAL (SELECT * FROM certificates c WHERE c.serial = u.serial ORDER BY "
      "c.at DESC LIMIT {}) c JOIN runs r ON r.arrival = c.arrival ORDER BY u.serial, c.at",
      instant("c.at"), calibrations_of_a_unit));
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  std::vector<Json> histories;
  for (int row = 0; row < rows->size(); ++row) {
    const std::string serial = rows->text(row, 0);
    if (histories.empty() || histories.back()["serial"] != serial) {
      histories.push_back(new_history(serial, rows->text(row, 1), *limits));
    }
    add_calibration(histories.back(), *rows, row);
  }
  return histories;
}

// What the model says in place of the interval and of straight lines.
Expected<void> take_forecasts(hub::Connection& connection, Json& page) {
  const auto rows = connection.ask(fmt::format(
      "SELECT f.serial, {}, p.name, {}, q.name, f.ramp::double precision[], f.ramp_sigma::double precision[] "
      "FROM forecasts f LEFT JOIN parameters p ON p.position = f.due_parameter LEFT JOIN parameters q ON "
      "q.position = f.passes_parameter",
      instant("f.due"), instant("f.passes")));
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  std::map<std::string, Json*> units;
  for (Json& unit : page["units"]) {
    units[unit["serial"].get<std::string>()] = &unit;
  }
  const double now = page["as_of_year"].get<double>() - 1970.0;
  for (int row = 0; row < rows->size(); ++row) {
    const auto found = units.find(rows->text(row, 0));
    if (found == units.end()) {
      continue;
    }
    Json& unit = *found->second;
    unit["due_utc"] = rows->text(row, 1);
    unit["due_in_days"] = std::round((year_of(rows->text(row, 1)) - now) * days_per_year);
    unit["due_for"] = rows->is_null(row, 2) ? Json() : Json(rows->text(row, 2));
    const auto ramp = rows->reals(row, 5), sigma = rows->reals(row, 6);
    for (std::size_t i = 0; i < unit["parameters"].size() && i < ramp.size() && i < sigma.size(); ++i) {
      Json& parameter = unit["parameters"][i];
      const bool passes = !rows->is_null(row, 4) && parameter["name"] == rows->text(row, 4);
      parameter["change_per_year"] = ramp[i];
      parameter["change_per_year_sigma"] = sigma[i];
      parameter["drifts"] = sigma[i] > 0.0 && std::abs(ramp[i]) > 3.0 * sigma[i];
      parameter["passes_limit_utc"] = passes ? Json(rows->text(row, 3)) : Json();
      parameter["passes_limit_earliest_utc"] = Json();
    }
  }
  return {};
}

Expected<void> take_sets(hub::Connection& connection, Json& page) {
  const auto rows = connection.ask(fmt::format(
      "SELECT s.name, (SELECT count(*) FROM runs r WHERE r.set_name = s.name), {}, (SELECT count(*) FROM refusals f "
      "WHERE f.set_name = s.name), (SELECT string_agg(DISTINCT p.name, ', ') FROM set_offsets o JOIN parameters p "
      "USING "
      "(position) WHERE o.set_name = s.name AND o.accused) FROM sets s ORDER BY s.name",
      instant("s.last_seen")));
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  page["sets"] = Json::array();
  for (int row = 0; row < rows->size(); ++row) {
    page["sets"].push_back({{"set", rows->text(row, 0)},
                            {"runs", rows->integer(row, 1)},
                            {"last_seen_utc", rows->is_null(row, 2) ? Json() : Json(rows->text(row, 2))},
                            {"refused", rows->integer(row, 3)},
                            {"accused_of", rows->is_null(row, 4) ? Json() : Json(rows->text(row, 4))}});
  }
  return {};
}

}  // namespace

Expected<Json> fleet_page_of_hub(const std::string& hub, const report::FleetOptions& options) {
  auto connection = hub::Connection::open(hub);
  if (!connection) {
    return tl::unexpected(connection.error());
  }
  auto zone = (*connection)->execute("SET TIME ZONE 'UTC'");
  const auto histories = zone ? histories_of(**connection) : tl::unexpected(zone.error());
  auto page = histories ? report::fleet_document(*histories, options) : tl::unexpected(histories.error());
  if (!page) {
    return page;
  }
  auto taken = take_forecasts(**connection, *page);
  if (taken) {
    taken = take_sets(**connection, *page);
  }
  return taken ? page : tl::unexpected(taken.error());
}

}  // namespace selfcal::cli
