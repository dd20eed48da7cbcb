// selfcal fleet status | due | unit | set | laws | limit | fit: what a depot's hub knows of its units and sets. Each question is
// one look at indexed rows; what takes long is done before, by fit.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/hub/hub_connection.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/command_line/depot_ranges.hpp"
#include "protocol/document/document_head.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/fleet_fit.hpp"
#include "tools/cli/hub_option.hpp"

namespace selfcal::cli {
namespace {

using hub::Value;
using Json = nlohmann::ordered_json;

struct Arguments {
  std::string hub, name, type, parameter;
  double days = 90.0;
  std::optional<double> change, size;
  FitOptions fit;
  bool json = false;
};

// A part of an answer: a table with a heading. Numbers are those columns of which the server says so.
struct Part {
  const char* key;  // in JSON
  const char* heading;
  std::vector<const char*> columns;
  std::string sql;
  std::vector<Value> values;
};

Json cell(const hub::Rows& rows, int row, int column) {
  if (rows.is_null(row, column)) {
    return {};
  }
  const std::string text = rows.text(row, column);
  if (rows.is_number(column)) {
    return Json::parse(text, nullptr, false);
  }
  return rows.is_boolean(column) ? Json(text == "t") : Json(text);
}

void print_table(const Part& part, const hub::Rows& rows) {
  std::vector<std::size_t> width;
  for (std::size_t c = 0; c < part.columns.size(); ++c) {
    width.push_back(std::string_view(part.columns[c]).size());
    for (int r = 0; r < rows.size(); ++r) {
      width[c] = std::max(width[c], rows.text(r, static_cast<int>(c)).size());
    }
  }
  fmt::print("{}{}\n", part.heading, rows.size() == 0 ? ": none" : "");
  for (int r = -1; r < rows.size() && rows.size() > 0; ++r) {
    std::string line;
    for (std::size_t c = 0; c < part.columns.size(); ++c) {
      line += fmt::format("  {:<{}}", r < 0 ? part.columns[c] : rows.text(r, static_cast<int>(c)), width[c]);
    }
    fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
  }
}

Expected<int> answer(hub::Connection& connection, const Arguments& arguments, const char* question,
                     const std::vector<Part>& parts) {
  Json document = document::with_head({"selfcal.fleet"}, Json{{"question", question}});
  for (const Part& part : parts) {
    const auto rows = connection.ask(part.sql, part.values);
    if (!rows) {
      return tl::unexpected(rows.error());
    }
    if (!arguments.json) {
      print_table(part, *rows);
      continue;
    }
    Json list = Json::array();
    for (int r = 0; r < rows->size(); ++r) {
      Json row = Json::object();
      for (std::size_t c = 0; c < part.columns.size(); ++c) {
        row[part.columns[c]] = cell(*rows, r, static_cast<int>(c));
      }
      list.push_back(std::move(row));
    }
    document[part.key] = std::move(list);
  }
  if (arguments.json) {
    fmt::print("{}\n", document.dump());
  }
  return 0;
}

constexpr const char* utc = "'YYYY-MM-DD\"T\"HH24:MI:SS\"Z\"'";

std::string instant(const char* column) { return fmt::format("to_char({}, {})", column, utc); }

Expected<int> status(hub::Connection& connection, const Arguments& arguments) {
  return answer(
      connection, arguments, "status",
      {{"depot",
        "Depot",
        {"sets", "units", "runs", "certificates", "refused", "overdue", "due_in_90_days", "fitted_utc", "runs_since"},
        fmt::format("SELECT (SELECT count(*) FROM sets), (SELECT count(*) FROM units), (SELECT count(*) FROM runs), "
                    "(SELECT count(*) FROM certificates), (SELECT count(*) FROM refusals), (SELECT count(*) FROM "
                    "forecasts WHERE due < now()), (SELECT count(*) FROM forecasts WHERE due BETWEEN now() AND now() + "
                    "interval '90 days'), (SELECT {} FROM fits), (SELECT count(*) FROM runs WHERE arrival > "
                    "coalesce((SELECT max(arrival) FROM fits), 0))",
                    instant("max(at)")),
        {}},
       {"sets",
        "Sets",
        {"set", "runs", "last_seen_utc", "software", "refused", "accused_of"},
        fmt::format(
            "SELECT s.name, coalesce(c.n, 0), {}, s.software, (SELECT count(*) FROM refusals f WHERE f.set_name "
            "= s.name), (SELECT string_agg(DISTINCT p.name, ', ') FROM set_offsets o JOIN parameters p USING "
            "(position) WHERE o.set_name = s.name AND o.accused) FROM sets s LEFT JOIN (SELECT set_name, "
            "count(*) AS n FROM runs GROUP BY 1) c ON c.set_name = s.name ORDER BY s.name",
            instant("s.last_seen")),
        {}}});
}

Expected<int> due(hub::Connection& connection, const Arguments& arguments) {
  return answer(connection, arguments, "due",
                {{"units",
                  "Due",
                  {"unit", "type", "last_utc", "due_utc", "days", "for", "passes_limit_utc", "passing"},
                  fmt::format("SELECT f.serial, u.type, {}, {}, round(extract(epoch FROM f.due - now()) / 86400)::int, "
                              "p.name, {}, q.name FROM forecasts f JOIN units u USING (serial) LEFT JOIN parameters p "
                              "ON p.position = f.due_parameter LEFT JOIN parameters q ON q.position = "
                              "f.passes_parameter WHERE f.due < now() + make_interval(secs => $1) ORDER BY f.due",
                              instant("f.last"), instant("f.due"), instant("f.passes")),
                  {fmt::format("{}", arguments.days * 86400.0)}}});
}

Expected<bool> exists(hub::Connection& connection, const std::string& sql, const std::string& name) {
  const auto rows = connection.ask(sql, {name});
  return rows ? Expected<bool>(rows->size() > 0) : tl::unexpected(rows.error());
}

Expected<int> unit(hub::Connection& connection, const Arguments& arguments) {
  const auto known = exists(connection, "SELECT 1 FROM units WHERE serial = $1", arguments.name);
  if (!known || !*known) {
    return known ? fail(ErrorKind::bad_input, fmt::format("unit {}: the hub does not know it", arguments.name))
                 : tl::unexpected(known.error());
  }
  return answer(
      connection, arguments, "unit",
      {{"certificates",
        "Last calibrations",
        {"utc", "set", "run"},
        fmt::format("SELECT {}, c.set_name, r.run FROM certificates c JOIN runs r USING (arrival) WHERE c.serial = $1 "
                    "ORDER BY c.at DESC LIMIT 10",
                    instant("c.at")),
        {arguments.name}},
       {"recordings",
        "Imported recordings",
        {"utc", "set", "run", "source"},
        fmt::format(
            "SELECT {}, r.set_name, r.run, r.source FROM runs r WHERE r.serial = $1 AND r.kind = 'recording' AND "
            "r.state = 'completed' ORDER BY r.ended DESC LIMIT 10",
            instant("r.ended")),
        {arguments.name}},
       {"forecast",
        "Next calibration",
        {"due_utc", "parameter", "unit", "last", "expected", "band_95", "change_per_year", "change_sigma"},
        fmt::format(
            "SELECT {}, p.name, p.unit, round(l.value[p.position]::numeric, 4), round(f.next[p.position]::numeric, 4), "
            "round((1.959964 * f.next_sigma[p.position])::numeric, 4), round(f.ramp[p.position]::numeric, 4), "
            "round(f.ramp_sigma[p.position]::numeric, 4) FROM forecasts f CROSS JOIN parameters p, LATERAL (SELECT "
            "c.value::double precision[] FROM certificates c WHERE c.serial = f.serial ORDER BY c.at DESC LIMIT 1) l "
            "WHERE f.serial = $1 ORDER BY p.position",
            instant("f.due")),
        {arguments.name}},
       {"resembling",
        "Units that resemble it",
        {"unit", "distance"},
        "SELECT g.serial, round(sqrt(sum(power((g.level[m.position] - f.level[m.position]) / m.unit_sd, 2)) / "
        "count(*))::numeric, 2) AS distance FROM forecasts f JOIN units u USING (serial) JOIN type_models m ON m.type "
        "= u.type AND m.unit_sd > 0 JOIN units v ON v.type = u.type AND v.serial <> u.serial JOIN forecasts g ON "
        "g.serial = v.serial WHERE f.serial = $1 GROUP BY g.serial ORDER BY distance, g.serial LIMIT 3",
        {arguments.name}},
       {"findings",
        "Physics named",
        {"effect", "parameter", "unit", "value", "sigma", "utc"},
        fmt::format("SELECT f.effect, f.parameter, f.unit, f.value, f.sigma, {} FROM findings f JOIN runs r USING "
                    "(arrival) WHERE f.serial = $1 ORDER BY r.ended DESC LIMIT 20",
                    instant("r.ended")),
        {arguments.name}}});
}

Expected<int> set(hub::Connection& connection, const Arguments& arguments) {
  const auto known = exists(connection, "SELECT 1 FROM sets WHERE name = $1", arguments.name);
  if (!known || !*known) {
    return known ? fail(ErrorKind::bad_input, fmt::format("set {}: the hub does not know it", arguments.name))
                 : tl::unexpected(known.error());
  }
  return answer(
      connection, arguments, "set",
      {{"offsets",
        "Against the fleet, worst first",
        {"accused", "type", "parameter", "unit", "recent_bias", "z", "units", "offset", "offset_sigma"},
        "SELECT o.accused, o.type, p.name, p.unit, round(o.bias::numeric, 4), round(o.z::numeric, 1), o.units, "
        "round(o.value::numeric, 4), round(o.sigma::numeric, 4) FROM set_offsets o JOIN parameters p USING "
        "(position) WHERE o.set_name = $1 ORDER BY abs(o.z) DESC",
        {arguments.name}},
       {"refusals",
        "Refused",
        {"utc", "run", "reason"},
        fmt::format("SELECT {}, run, reason FROM refusals WHERE set_name = $1 ORDER BY at DESC LIMIT 20",
                    instant("at")),
        {arguments.name}}});
}

// A law of the type: named in three units and more. The spread is what its amplitude differs by from unit to unit.
Expected<int> laws(hub::Connection& connection, const Arguments& arguments) {
  return answer(
      connection, arguments, "laws",
      {{"laws",
        "Physics that units of a type share",
        {"type", "effect", "parameter", "unit", "units", "of", "mean", "spread", "sigma"},
        "SELECT u.type, f.effect, f.parameter, f.unit, count(*), (SELECT count(*) FROM units w WHERE w.type = "
        "u.type), avg(f.value), coalesce(stddev_samp(f.value), 0), sqrt(avg(f.sigma * f.sigma)) FROM (SELECT "
        "DISTINCT ON (serial, effect, parameter) serial, effect, parameter, unit, value, sigma FROM findings "
        "ORDER BY serial, effect, parameter, arrival DESC) f JOIN units u USING (serial) GROUP BY 1, 2, 3, 4 "
        "HAVING count(*) >= 3 ORDER BY 1, 5 DESC, 2, 3",
        {}}});
}

Expected<int> limit(hub::Connection& connection, const Arguments& arguments) {
  if (!arguments.change && !arguments.size) {
    return fail(ErrorKind::usage, "--change or --size is missing");
  }
  const auto figure = [](const std::optional<double>& value) {
    return value ? Value(fmt::format("{:.17g}", *value)) : Value();
  };
  const auto rows = connection.ask(
      "INSERT INTO limits SELECT $1, position, $3::finite, $4::finite FROM parameters WHERE name = $2 OR "
      "regexp_replace(name, '_[^_]+$', '') = $2 ON CONFLICT (type, position) DO UPDATE SET change = "
      "coalesce(excluded.change, limits.change), size = coalesce(excluded.size, limits.size) RETURNING position",
      {arguments.type, arguments.parameter, figure(arguments.change), figure(arguments.size)});
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  if (rows->size() == 0) {
    return fail(ErrorKind::bad_input,
                fmt::format("{} is no parameter and no group of parameters", arguments.parameter));
  }
  fmt::print("{}: limits of {} parameters set\n", arguments.type, rows->size());
  return 0;
}

Expected<int> fit(hub::Connection& connection, const Arguments& arguments) {
  const auto counts = fit_fleet(connection, arguments.fit);
  if (!counts) {
    return tl::unexpected(counts.error());
  }
  fmt::print("fitted {} certificates of {} units of {} types; {} of {} sets accused\n", counts->certificates,
             counts->units, counts->types, counts->accused, counts->sets);
  return 0;
}

struct Below {
  Options options;
  Expected<int> (*run)(hub::Connection&, const Arguments&);
};

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  auto all = std::make_shared<std::vector<Below>>();
  all->reserve(7);
  const auto add = [&](const char* name, const char* help, auto run, bool question) -> Options& {
    all->push_back({options.command(name, help), run});
    Options& below = all->back().options;
    below.text("--hub", arguments->hub, hub_help);
    if (question) {
      below.flag("--json", arguments->json, "print a JSON document");
    }
    return below;
  };
  add("status", "sets, units, what waits, which set is accused of a bias", status, true);
  add("due", "units by when they are due", due, true).number("--days", arguments->days, range::look_ahead, "ahead");
  add("unit", "a unit's calibrations, forecast, resembling units", unit, true)
      .text("SERIAL", arguments->name, "of the unit", Needed::yes);
  add("set", "a set against the fleet", set, true).text("NAME", arguments->name, "of the set", Needed::yes);
  add("laws", "physics that units of a type share, with its spread", laws, true);
  Options& limits = add("limit", "what a parameter of a type may change by, and be", limit, false);
  limits.text("TYPE", arguments->type, "of the units", Needed::yes);
  limits.text("PARAMETER", arguments->parameter, "or a group of parameters (gyro_scale)", Needed::yes);
  limits.number("--change", arguments->change, range::parameter_limit, "since the last calibration");
  limits.number("--size", arguments->size, range::parameter_limit, "of the value");
  Options& fitting = add("fit", "fits the model to all certificates; the questions answer from it", fit, false);
  fitting.number("--risk", arguments->fit.risk, range::risk, "that a unit leaves its limits before it is due");
  fitting.number("--longest", arguments->fit.longest_years, range::calibration_interval, "between calibrations");
  fitting.number("--false-accusations", arguments->fit.false_accusation, range::false_alarm_rate,
                 "of sound sets, a year");
  return [arguments, all]() -> Expected<int> {
    for (const Below& below : *all) {
      if (below.options.chosen()) {
        auto connection = hub::Connection::open(hub_connection_string(arguments->hub));
        return connection ? below.run(**connection, *arguments) : tl::unexpected(connection.error());
      }
    }
    return fail(ErrorKind::internal, "fleet: no command chosen");
  };
}

const CommandRegistration registration{{"fleet", "a depot's units and sets: due, drifting, biased", configure}};

}  // namespace
}  // namespace selfcal::cli
