#include "daemon/hub/hub_schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "daemon/hub/migrations.hpp"
#include "daemon/hub/recording_folder.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::hub {
namespace {

// Each finds rows that nothing but a fault of ours or a hand in the database can bring about.
struct Question {
  const char* sql;  // counts them
  const char* words;
};
constexpr Question questions[] = {
    {"SELECT count(*) FROM certificates c JOIN runs r USING (arrival) WHERE c.serial <> r.serial OR c.at <> r.ended OR "
     "r.state <> 'completed' OR c.set_name <> r.set_name",
     "certificates that differ from their run"},
    {"SELECT count(*) FROM measurements m JOIN runs r USING (arrival) WHERE m.serial <> r.serial OR m.at <> r.ended OR "
     "r.state <> 'completed' OR r.kind <> 'recording'",
     "measurements that differ from their run"},
    {"SELECT count(*) FROM certificates c WHERE NOT EXISTS (SELECT FROM validities v WHERE v.arrival = c.arrival)",
     "certificates that were never in force"},
    {"SELECT count(*) FROM (SELECT upper(valid) AS ended, lead(lower(valid)) OVER (PARTITION BY serial ORDER BY valid) "
     "AS next FROM validities) v WHERE ended IS DISTINCT FROM next",
     "coefficients whose validity does not end where the next begins"},
    {"SELECT count(*) FROM (SELECT sequence <= lag(sequence) OVER (PARTITION BY set_name ORDER BY arrival) AS back "
     "FROM runs) o WHERE back",
     "runs that arrived before an earlier one of their set"},
    {"SELECT count(*) FROM sets s WHERE last_sequence < (SELECT max(sequence) FROM runs r WHERE r.set_name = s.name)",
     "sets whose last sequence is behind their runs"},
    {"SELECT count(*) FROM sets WHERE NOT EXISTS (SELECT FROM pg_roles WHERE rolname = role)",
     "sets whose role does not exist"},
    {"SELECT count(*) FROM pg_constraint WHERE connamespace = 'selfcal'::regnamespace AND NOT convalidated",
     "constraints that are not validated"},
    {"SELECT count(*) FROM pg_index i JOIN pg_class c ON c.oid = i.indexrelid WHERE c.relnamespace = "
     "'selfcal'::regnamespace AND NOT i.indisvalid",
     "indices that are not valid"},
};

Expected<void> steps_within(Connection& connection, int from) {
  for (int version = from + 1; version <= known_version(); ++version) {
    if (auto ok = connection.execute(std::string(migrations()[static_cast<std::size_t>(version - 1)])); !ok) {
      return fail(ok.error().kind, fmt::format("schema version {}: {}", version, ok.error().message));
    }
    const auto noted = connection.ask("INSERT INTO schema_version(version) VALUES ($1)", {std::to_string(version)});
    if (!noted) {
      return tl::unexpected(noted.error());
    }
  }
  return {};
}

Expected<void> check_parameters(Connection& connection, std::vector<std::string>& faults) {
  const auto rows = connection.ask("SELECT name, unit FROM parameters ORDER BY position");
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  for (int i = 0; i < std::max(rows->size(), sensor_parameter_count); ++i) {
    if (i >= rows->size() || i >= sensor_parameter_count) {
      faults.push_back(fmt::format("parameters: {} rows, {} expected", rows->size(), sensor_parameter_count));
      break;
    }
    const SensorParameter& ours = sensor_parameters[static_cast<std::size_t>(i)];
    if (rows->text(i, 0) != ours.name || rows->text(i, 1) != ours.unit) {
      faults.push_back(fmt::format("parameters: {} is {} in {}, {} in {} expected", i + 1, rows->text(i, 0),
                                   rows->text(i, 1), ours.name, ours.unit));
    }
  }
  return {};
}

Expected<void> check_recordings(Connection& connection, const std::string& folder, std::vector<std::string>& faults) {
  const auto rows = connection.ask("SELECT sha256, bytes FROM recordings ORDER BY sha256");
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  for (int i = 0; i < rows->size(); ++i) {
    if (const std::string fault = recording_fault(folder, rows->text(i, 0), rows->integer(i, 1)); !fault.empty()) {
      faults.push_back(fault);
    }
  }
  return {};
}

}  // namespace

int known_version() { return static_cast<int>(migrations().size()); }

Expected<int> version_of(Connection& connection) {
  const auto there = connection.ask("SELECT to_regclass('selfcal.schema_version') IS NOT NULL");
  if (!there) {
    return tl::unexpected(there.error());
  }
  if (there->text(0, 0) != "t") {
    return 0;
  }
  const auto rows = connection.ask("SELECT coalesce(max(version), 0) FROM selfcal.schema_version");
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  return static_cast<int>(rows->integer(0, 0));
}

Expected<int> migrate(Connection& connection) {
  // Sets go on sending. A run is stored under the second lock (submit_run), so none is half stored when the first table
  // is changed: the steps and a run lock the same tables in different orders.
  const auto begun = connection.execute(
      "BEGIN; SET LOCAL lock_timeout = '10s'; SET LOCAL client_min_messages = warning; "
      "SELECT pg_advisory_xact_lock(hashtext('selfcal.schema')); "
      "SELECT pg_advisory_xact_lock(hashtext('selfcal.arrivals'))");
  if (!begun) {
    return tl::unexpected(begun.error());
  }
  const auto give_up = [&](const Error& error) -> tl::unexpected<Error> {
    (void)connection.execute("ROLLBACK");
    return tl::unexpected(error);
  };
  const auto version = version_of(connection);
  if (!version) {
    return give_up(version.error());
  }
  if (*version > known_version()) {
    return give_up({ErrorKind::device, fmt::format("hub {}: schema version {} is newer than this program's {}",
                                                   connection.place(), *version, known_version())});
  }
  if (*version == 0) {
    const auto made = connection.execute(
        "CREATE SCHEMA selfcal; CREATE TABLE selfcal.schema_version(version integer PRIMARY KEY, applied timestamptz "
        "NOT NULL DEFAULT now())");
    if (!made) {
      return give_up(made.error());
    }
  }
  if (auto ok = steps_within(connection, *version); !ok) {
    return give_up(ok.error());
  }
  if (auto ok = connection.execute("COMMIT"); !ok) {
    return give_up(ok.error());
  }
  return *version;
}

Expected<std::vector<std::string>> check(Connection& connection, const std::string& recordings) {
  const auto version = version_of(connection);
  if (!version) {
    return tl::unexpected(version.error());
  }
  if (*version == 0) {
    return fail(ErrorKind::bad_input, fmt::format("hub {}: no hub there (selfcal hub init)", connection.place()));
  }
  std::vector<std::string> faults;
  if (*version != known_version()) {
    faults.push_back(fmt::format("schema version {}, this program's is {}{}", *version, known_version(),
                                 *version < known_version() ? " (selfcal hub migrate)" : ""));
  }
  if (auto ok = check_parameters(connection, faults); !ok) {
    return tl::unexpected(ok.error());
  }
  for (const Question& question : questions) {
    const auto rows = connection.ask(question.sql);
    if (!rows) {
      return tl::unexpected(rows.error());
    }
    if (const auto count = rows->integer(0, 0); count != 0) {
      faults.push_back(fmt::format("{} {}", count, question.words));
    }
  }
  if (!recordings.empty()) {
    if (auto ok = check_recordings(connection, recordings, faults); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  return faults;
}

Expected<void> admit(Connection& connection, const std::string& kind, const std::string& name,
                     const std::string& password) {
  const auto verifier = connection.scram_verifier(name, password);
  if (!verifier) {
    return tl::unexpected(verifier.error());
  }
  const auto known = connection.ask("SELECT 1 FROM pg_roles WHERE rolname = $1", {name});
  if (!known) {
    return tl::unexpected(known.error());
  }
  std::string sql =
      fmt::format("BEGIN; {} ROLE {} LOGIN PASSWORD {}; GRANT {} TO {};", known->size() > 0 ? "ALTER" : "CREATE",
                  sql_name(name), sql_text(*verifier), sql_name("selfcal_" + kind), sql_name(name));
  if (kind == "set") {
    sql += fmt::format(" INSERT INTO sets(name, role) VALUES ({0}, {0}) ON CONFLICT DO NOTHING;", sql_text(name));
  }
  if (auto ok = connection.execute(sql + " COMMIT"); !ok) {
    (void)connection.execute("ROLLBACK");
    return ok;
  }
  return {};
}

}  // namespace selfcal::hub
