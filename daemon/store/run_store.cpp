#include "daemon/store/run_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "daemon/store/sqlite.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal {
namespace {

using sqlite::database_error;
using sqlite::Statement;

// Step k takes a database from version k to k + 1; version 0 is an empty file.
constexpr std::array schema_steps{R"sql(
CREATE TABLE runs(
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  ins TEXT NOT NULL, serial TEXT NOT NULL, ins_software TEXT NOT NULL, state TEXT NOT NULL, user TEXT NOT NULL,
  schedule TEXT NOT NULL, dry_run INTEGER NOT NULL, force_reason TEXT NOT NULL, rollback INTEGER NOT NULL,
  started_utc TEXT NOT NULL, ended_utc TEXT NOT NULL, software TEXT NOT NULL, exit_status INTEGER NOT NULL,
  reason TEXT NOT NULL, abort_wanted INTEGER NOT NULL, rotation INTEGER NOT NULL, recording TEXT NOT NULL,
  result_json TEXT NOT NULL, drift_old_m REAL NOT NULL, drift_new_m REAL NOT NULL);
CREATE INDEX runs_by_serial ON runs(serial);
CREATE TABLE events(
  id INTEGER PRIMARY KEY AUTOINCREMENT, run INTEGER NOT NULL REFERENCES runs(id),
  utc TEXT NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL);
CREATE INDEX events_by_run ON events(run);
CREATE TABLE parameters(
  run INTEGER NOT NULL REFERENCES runs(id), name TEXT NOT NULL, unit TEXT NOT NULL,
  value REAL NOT NULL, sigma REAL NOT NULL, determined INTEGER NOT NULL, PRIMARY KEY(run, name));
CREATE TABLE coefficient_sets(
  run INTEGER NOT NULL REFERENCES runs(id), role TEXT NOT NULL, bytes BLOB NOT NULL, PRIMARY KEY(run, role));
)sql",
                                  R"sql(
ALTER TABLE runs ADD COLUMN stop_when_met INTEGER NOT NULL DEFAULT 0;
ALTER TABLE runs ADD COLUMN early_end_s REAL NOT NULL DEFAULT -1;
)sql",
                                  R"sql(
ALTER TABLE runs ADD COLUMN amends INTEGER NOT NULL DEFAULT 0;
)sql",
                                  R"sql(
ALTER TABLE runs ADD COLUMN amends_with TEXT NOT NULL DEFAULT '';
)sql",
                                  // For a depot's hub (daemon/hub): what goes there, entered in the transaction that
                                  // ends a run, and what other sets measured, as it came from there.
                                  R"sql(
CREATE TABLE outbox(
  sequence INTEGER PRIMARY KEY AUTOINCREMENT, run INTEGER NOT NULL UNIQUE REFERENCES runs(id),
  document TEXT NOT NULL DEFAULT '', answer TEXT NOT NULL DEFAULT '');
CREATE INDEX outbox_waiting ON outbox(sequence) WHERE answer='';
INSERT INTO outbox(run) SELECT id FROM runs WHERE state IN ('completed','refused','failed','aborted') ORDER BY id;
CREATE TRIGGER run_ended AFTER UPDATE OF state ON runs
  WHEN NEW.state IN ('completed','refused','failed','aborted')
   AND OLD.state NOT IN ('completed','refused','failed','aborted')
  BEGIN INSERT OR IGNORE INTO outbox(run) VALUES(NEW.id); END;
CREATE TABLE hub_past(
  arrival INTEGER PRIMARY KEY, set_name TEXT NOT NULL, run INTEGER NOT NULL, serial TEXT NOT NULL, utc TEXT NOT NULL);
CREATE INDEX hub_past_by_serial ON hub_past(serial, arrival);
CREATE TABLE hub_past_parameters(
  arrival INTEGER NOT NULL REFERENCES hub_past(arrival), name TEXT NOT NULL,
  value REAL NOT NULL, sigma REAL NOT NULL, determined INTEGER NOT NULL, PRIMARY KEY(arrival, name)) WITHOUT ROWID;
)sql",
                                  R"sql(
ALTER TABLE runs ADD COLUMN source TEXT NOT NULL DEFAULT '';
)sql"};
constexpr auto schema_version = static_cast<std::int64_t>(schema_steps.size());

constexpr std::string_view run_columns =
    "id, ins, serial, ins_software, state, user, schedule, dry_run, force_reason, rollback, started_utc, ended_utc, "
    "software, exit_status, reason, abort_wanted, rotation, recording, result_json, drift_old_m, drift_new_m, "
    "stop_when_met, early_end_s, amends, amends_with, source";

constexpr const char* final_states = "('completed','refused','failed','aborted')";

Expected<void> execute(sqlite3* database, const char* sql) {
  if (sqlite3_exec(database, sql, nullptr, nullptr, nullptr) != SQLITE_OK) {
    return database_error(database, sql);
  }
  return {};
}

Expected<std::int64_t> single_integer(sqlite3* database, std::string_view sql) {
  Statement statement(database, sql);
  const auto row = statement.step();
  if (!row) {
    return tl::unexpected(row.error());
  }
  return *row ? statement.integer() : 0;
}

// "3 7": numbers of runs as they are kept.
std::string text_of(const std::vector<RunId>& runs) { return fmt::format("{}", fmt::join(runs, " ")); }

std::vector<RunId> numbers_of(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<RunId>(words), std::istream_iterator<RunId>()};
}

RunRecord read_run(Statement& row) {
  RunRecord run;
  run.id = row.integer();
  run.ins = row.text();
  run.serial = row.text();
  run.ins_software = row.text();
  run.state = state_from_name(row.text()).value_or(State::failed);
  run.user = row.text();
  run.schedule = row.text();
  run.dry_run = row.integer() != 0;
  run.force_reason = row.text();
  run.rollback = row.integer() != 0;
  run.started_utc = row.text();
  run.ended_utc = row.text();
  run.software = row.text();
  run.exit_status = static_cast<int>(row.integer());
  run.reason = row.text();
  run.abort_wanted = row.integer() != 0;
  run.rotation = static_cast<std::uint32_t>(row.integer());
  run.recording = row.text();
  run.result_json = row.text();
  run.drift_old_m = row.real();
  run.drift_new_m = row.real();
  run.stop_when_met = row.integer() != 0;
  run.early_end_s = row.real();
  run.amends = row.integer();
  run.amends_with = numbers_of(row.text());
  run.source = row.text();
  return run;
}

Expected<std::vector<RunRecord>> read_runs(Statement& statement) {
  std::vector<RunRecord> runs;
  while (true) {
    const auto row = statement.step();
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!*row) {
      return runs;
    }
    runs.push_back(read_run(statement));
  }
}

std::string role_name(SetRole role) {
  switch (role) {
    case SetRole::previous: return "previous";
    case SetRole::written: return "written";
    default: return "read_back";
  }
}

Expected<void> verify_integrity(sqlite3* database) {
  Statement statement(database, "PRAGMA integrity_check(1)");
  const auto row = statement.step();
  if (!row) {
    return tl::unexpected(row.error());
  }
  std::string verdict = statement.text();
  if (verdict == "ok") {
    return {};
  }
  std::replace(verdict.begin(), verdict.end(), '\n', ' ');  // an error is one line
  return fail(ErrorKind::device,
              fmt::format("database {}: damaged: {}; restore a backup (selfcal db restore --offline NAME)",
                          sqlite3_db_filename(database, "main"), verdict));
}

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
using Handle = std::unique_ptr<sqlite3, Close>;

Expected<Handle> open_handle(const std::filesystem::path& file, int flags) {
  sqlite3* raw = nullptr;
  const int result = sqlite3_open_v2(file.c_str(), &raw, flags, nullptr);
  Handle database(raw);
  if (result != SQLITE_OK) {
    return fail(ErrorKind::device, fmt::format("database {}: {}", file.string(), sqlite::failure_words(raw)));
  }
  sqlite3_busy_timeout(raw, 2000);
  return database;
}

}  // namespace

std::string_view run_kind(const RunRecord& run) {
  return run.rollback ? "rollback" : run.amends != 0 ? "amendment" : !run.source.empty() ? "recording" : "calibration";
}

Expected<std::unique_ptr<RunStore>> RunStore::open(const std::filesystem::path& file) {
  auto database = open_handle(file, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (!database) {
    return tl::unexpected(database.error());
  }
  if (auto ok = verify_integrity(database->get()); !ok) {
    return tl::unexpected(ok.error());
  }
  for (const char* pragma : {"PRAGMA journal_mode=WAL", "PRAGMA synchronous=FULL", "PRAGMA foreign_keys=ON"}) {
    if (auto ok = execute(database->get(), pragma); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  const auto version = single_integer(database->get(), "PRAGMA user_version");
  if (!version) {
    return tl::unexpected(version.error());
  }
  if (*version > schema_version) {
    return fail(ErrorKind::device, fmt::format("database {}: schema version {} is newer than this program's {}",
                                               file.string(), *version, schema_version));
  }
  for (auto step = *version; step < schema_version; ++step) {
    const std::string upgrade = fmt::format("BEGIN IMMEDIATE; {} PRAGMA user_version={}; COMMIT;",
                                            schema_steps.at(static_cast<std::size_t>(step)), step + 1);
    if (auto ok = execute(database->get(), upgrade.c_str()); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  return std::unique_ptr<RunStore>(new RunStore(database->release()));
}

RunStore::~RunStore() { sqlite3_close(database_); }

Expected<RunId> RunStore::create_run(const RunRecord& run) {
  Statement insert(
      database_,
      "INSERT INTO runs(ins, serial, ins_software, state, user, schedule, dry_run, force_reason, rollback, "
      "started_utc, ended_utc, software, exit_status, reason, abort_wanted, rotation, recording, "
      "result_json, drift_old_m, drift_new_m, stop_when_met, amends, amends_with, source) "
      "VALUES(?,?,?,?,?,?,?,?,?,?,'',?,-1,'',0,0,?,'',-1,-1,?,?,?,?)");
  insert.bind(run.ins).bind(run.serial).bind(run.ins_software).bind(std::string(name(run.state))).bind(run.user);
  insert.bind(run.schedule).bind(std::int64_t{run.dry_run}).bind(run.force_reason).bind(std::int64_t{run.rollback});
  insert.bind(run.started_utc).bind(run.software).bind(run.recording).bind(std::int64_t{run.stop_when_met});
  insert.bind(run.amends).bind(text_of(run.amends_with)).bind(run.source);
  if (auto ok = insert.run(); !ok) {
    return tl::unexpected(ok.error());
  }
  return sqlite3_last_insert_rowid(database_);
}

Expected<void> RunStore::update_run(const RunRecord& run) {
  Statement update(database_,
                   "UPDATE runs SET serial=?, ins_software=?, state=?, ended_utc=?, exit_status=?, reason=?, "
                   "abort_wanted=?, rotation=?, recording=?, result_json=?, drift_old_m=?, drift_new_m=?, "
                   "early_end_s=? WHERE id=?");
  update.bind(run.serial).bind(run.ins_software).bind(std::string(name(run.state))).bind(run.ended_utc);
  update.bind(std::int64_t{run.exit_status}).bind(run.reason).bind(std::int64_t{run.abort_wanted});
  update.bind(std::int64_t{run.rotation}).bind(run.recording).bind(run.result_json);
  update.bind(run.drift_old_m).bind(run.drift_new_m).bind(run.early_end_s).bind(run.id);
  return update.run();
}

Expected<void> RunStore::add_event(RunId run, const EventRecord& event) {
  Statement insert(database_, "INSERT INTO events(run, utc, kind, text) VALUES(?,?,?,?)");
  return insert.bind(run).bind(event.utc).bind(event.kind).bind(event.text).run();
}

Expected<void> RunStore::store_set(RunId run, SetRole role, const std::vector<std::uint8_t>& bytes) {
  Statement insert(database_, "INSERT OR REPLACE INTO coefficient_sets(run, role, bytes) VALUES(?,?,?)");
  return insert.bind(run).bind(role_name(role)).bind(bytes).run();
}

Expected<void> RunStore::store_parameters(RunId run, const Parameters& parameters) {
  if (auto ok = execute(database_, "BEGIN IMMEDIATE"); !ok) {
    return ok;
  }
  Statement insert(database_,
                   "INSERT OR REPLACE INTO parameters(run, name, unit, value, sigma, determined) VALUES(?,?,?,?,?,?)");
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    insert.bind(run).bind(std::string(sensor_parameters[i].name)).bind(std::string(sensor_parameters[i].unit));
    insert.bind(parameters.value[i]).bind(parameters.sigma[i]).bind(std::int64_t{parameters.determined[i]});
    if (auto ok = insert.run(); !ok) {
      (void)execute(database_, "ROLLBACK");
      return ok;
    }
  }
  return execute(database_, "COMMIT");
}

Expected<std::optional<RunRecord>> RunStore::run(RunId id) const {
  Statement select(database_, fmt::format("SELECT {} FROM runs WHERE id=?", run_columns));
  select.bind(id);
  const auto row = select.step();
  if (!row) {
    return tl::unexpected(row.error());
  }
  if (!*row) {
    return std::optional<RunRecord>();
  }
  return read_run(select);
}

Expected<std::vector<RunRecord>> RunStore::unfinished_runs() const {
  Statement select(database_,
                   fmt::format("SELECT {} FROM runs WHERE state NOT IN {} ORDER BY id", run_columns, final_states));
  return read_runs(select);
}

Expected<std::vector<RunRecord>> RunStore::runs_of_serial(const std::string& serial) const {
  Statement select(database_, fmt::format("SELECT {} FROM runs WHERE ?1='' OR serial=?1 ORDER BY id", run_columns));
  select.bind(serial);
  return read_runs(select);
}

Expected<std::vector<EventRecord>> RunStore::events(RunId run) const {
  Statement select(database_, "SELECT utc, kind, text FROM events WHERE run=? ORDER BY id");
  select.bind(run);
  std::vector<EventRecord> events;
  while (true) {
    const auto row = select.step();
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!*row) {
      return events;
    }
    EventRecord event;
    event.utc = select.text();
    event.kind = select.text();
    event.text = select.text();
    events.push_back(std::move(event));
  }
}

Expected<std::optional<std::vector<std::uint8_t>>> RunStore::set(RunId run, SetRole role) const {
  Statement select(database_, "SELECT bytes FROM coefficient_sets WHERE run=? AND role=?");
  select.bind(run).bind(role_name(role));
  const auto row = select.step();
  if (!row) {
    return tl::unexpected(row.error());
  }
  if (!*row) {
    return std::optional<std::vector<std::uint8_t>>();
  }
  return select.blob();
}

// Of this set and, as run 0, of others of the depot: what the hub told of them.
Expected<std::vector<ParameterRecord>> RunStore::parameter_history(const std::string& serial, int index) const {
  Statement select(
      database_,
      "SELECT r.id, r.ended_utc AS utc, p.value, p.sigma, p.determined FROM parameters p JOIN runs r ON "
      "p.run=r.id WHERE r.serial=?1 AND r.state='completed' AND (r.dry_run=0 OR r.source<>'') AND p.name=?2 UNION ALL "
      "SELECT 0, h.utc, p.value, p.sigma, p.determined FROM hub_past_parameters p JOIN hub_past h ON "
      "p.arrival=h.arrival WHERE h.serial=?1 AND p.name=?2 ORDER BY utc, 1");
  select.bind(serial).bind(std::string(sensor_parameters.at(static_cast<std::size_t>(index)).name));
  std::vector<ParameterRecord> history;
  while (true) {
    const auto row = select.step();
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!*row) {
      return history;
    }
    ParameterRecord record;
    record.run = select.integer();
    record.utc = select.text();
    record.value = select.real();
    record.sigma = select.real();
    record.determined = select.integer() != 0;
    history.push_back(std::move(record));
  }
}

Expected<std::vector<RunRecord>> RunStore::runs_with_recordings() const {
  Statement select(database_, fmt::format("SELECT {} FROM runs WHERE recording<>'' AND state IN {} ORDER BY id",
                                          run_columns, final_states));
  return read_runs(select);
}

Expected<void> RunStore::check(const std::filesystem::path& file) {
  auto database = open_handle(file, SQLITE_OPEN_READWRITE);
  if (!database) {
    return tl::unexpected(database.error());
  }
  if (auto ok = verify_integrity(database->get()); !ok) {
    return ok;
  }
  const auto orphans =
      single_integer(database->get(),
                     "SELECT (SELECT count(*) FROM events WHERE run NOT IN (SELECT id FROM runs)) + (SELECT count(*) "
                     "FROM parameters WHERE run NOT IN (SELECT id FROM runs)) + (SELECT count(*) FROM "
                     "coefficient_sets WHERE run NOT IN (SELECT id FROM runs))");
  if (!orphans) {
    return tl::unexpected(orphans.error());
  }
  if (*orphans == 0) {
    return {};
  }
  return fail(ErrorKind::device, fmt::format("database {}: {} rows belong to no run", file.string(), *orphans));
}

Expected<void> RunStore::copy(const std::filesystem::path& from, const std::filesystem::path& to) {
  auto source = open_handle(from, SQLITE_OPEN_READWRITE);
  if (!source) {
    return tl::unexpected(source.error());
  }
  if (auto ok = verify_integrity(source->get()); !ok) {
    return ok;
  }
  auto target = open_handle(to, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (!target) {
    return tl::unexpected(target.error());
  }
  sqlite3_backup* backup = sqlite3_backup_init(target->get(), "main", source->get(), "main");
  if (backup == nullptr) {
    return database_error(target->get(), "start copying");
  }
  sqlite3_backup_step(backup, -1);
  if (sqlite3_backup_finish(backup) != SQLITE_OK) {
    return database_error(target->get(), "copy");
  }
  return verify_integrity(target->get());
}

}  // namespace selfcal
