// What operators may ask of the service (operator_service.hpp).
#include <fmt/format.h>

#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include "daemon/host/journal.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/ins/open_port.hpp"
#include "daemon/ins/unlock_key.hpp"
#include "daemon/service.hpp"
#include "daemon/store/database_copies.hpp"
#include "daemon/store/recording_store.hpp"
#include "daemon/store/run_documents.hpp"
#include "protocol/can/link.hpp"
#include "protocol/flash/crc32c.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/operator_api/names.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t mebibyte = 1 << 20;
constexpr std::size_t longest_schedule = 65'536;  // bytes; 255 positions are some 10 KiB
constexpr std::size_t most_together =
    7;  // beside the one amended: time and memory of the search grow with their number
// A request keeps a session alive for S3, 5 s: one that a run or another tester left behind must be able to end.
constexpr auto between_questions = std::chrono::seconds(6);

tl::unexpected<Refusal> refuse(const char* name, std::string message) {
  return tl::unexpected<Refusal>(Refusal{name, std::move(message)});
}

tl::unexpected<Refusal> unavailable(const Error& error) {
  return refuse(operator_api::error_unavailable, error.message);
}

// The configured timing is that of the named schedules; a file has its own.
Expected<Schedule> schedule_of(const InsConfig& config, const std::string& name_or_file) {
  if (named_schedule(name_or_file)) {
    return find_schedule(name_or_file, config.dwell_s, config.rotation_s);
  }
  return find_schedule(name_or_file);
}

}  // namespace

Expected<void> Service::attach(Session& session, RunRecord record, const std::string& schedule_name) {
  auto schedule = schedule_of(session.config, schedule_name);
  if (!schedule) {
    return tl::unexpected(schedule.error());
  }
  const auto key = load_unlock_key(session.config);
  if (!key) {
    return tl::unexpected(key.error());
  }
  std::error_code error;
  fs::create_directories(run_folder(record.id), error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", run_folder(record.id).string(), error.message()));
  }
  session.run.reset();
  session.port = open_port(loop_, session.config);
  if (!session.estimators) {
    session.estimators = std::make_unique<EstimateWorker>(loop_);
  }
  const std::filesystem::path folder = run_folder(record.id);
  session.run = std::make_unique<CalibrationRun>(RunContext{loop_, *store_, *session.port, *session.estimators, *this},
                                                 session.config, std::move(*schedule), *key, std::move(record), folder);
  return {};
}

Granted<RunId> Service::launch(Session& session, RunRecord record, const std::string& schedule_name) {
  if (session.active()) {
    const RunRecord& other = session.run->record();
    return refuse(operator_api::error_busy,
                  fmt::format("busy, run {} by user {} since {}", other.id, other.user, other.started_utc));
  }
  if (stopping_) {
    return refuse(operator_api::error_unavailable, "the daemon is stopping");
  }
  if (session.ending()) {
    session.run->report_end_at_once();
  }
  const auto least = static_cast<std::uint64_t>(config_.free_space_mib) * mebibyte;
  if (auto room = require_space(config_.state_directory, least, "a run (free_space_mib)"); !room) {
    return unavailable(room.error());
  }
  // Checked before a run exists, so that a wrong name leaves no trace.
  if (auto schedule = schedule_of(session.config, schedule_name); !schedule) {
    return refuse(operator_api::error_unknown, schedule.error().message);
  }
  if (const auto key = load_unlock_key(session.config); !key) {
    return unavailable(key.error());
  }
  record.ins = session.config.name;
  record.schedule = schedule_name;
  record.started_utc = utc_now();
  record.software = SELFCAL_VERSION;
  const auto id = store_->create_run(record);
  if (!id) {
    return unavailable(id.error());
  }
  record.id = *id;
  if (auto attached = attach(session, record, schedule_name); !attached) {
    return unavailable(attached.error());
  }
  session.bus_answer.clear();
  session.run->begin();
  notify_status();
  return *id;
}

Granted<RunId> Service::start(const StartRequest& request) {
  Session* chosen = session(request.ins);
  if (request.ins.empty() && sessions_.size() == 1) {
    chosen = &sessions_.begin()->second;
  }
  if (chosen == nullptr) {
    return refuse(operator_api::error_unknown,
                  fmt::format("no INS \"{}\"; configured: {}", request.ins, fmt::join(instruments(), ", ")));
  }
  RunRecord record;
  record.user = request.user;
  record.dry_run = request.dry_run;
  record.force_reason = request.force_reason;
  record.stop_when_met = request.stop_when_met;
  if (!request.schedule_toml.empty()) {
    const auto kept = keep_schedule(request.schedule_toml);
    return kept ? launch(*chosen, record, kept->string()) : Granted<RunId>(tl::unexpected(kept.error()));
  }
  return launch(*chosen, record, request.schedule.empty() ? chosen->config.schedule : request.schedule);
}

// Named by what is in it, so that a run which is taken up again after a restart finds its own.
Granted<fs::path> Service::keep_schedule(const std::string& toml) const {
  if (toml.size() > longest_schedule) {
    return refuse(operator_api::error_unknown,
                  fmt::format("schedule_toml: {} bytes, {} at most", toml.size(), longest_schedule));
  }
  if (const auto schedule = parse_schedule(toml, "schedule_toml"); !schedule) {
    return refuse(operator_api::error_unknown, schedule.error().message);
  }
  const fs::path folder = fs::path(config_.state_directory) / "schedules";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return refuse(operator_api::error_unavailable, fmt::format("{}: {}", folder.string(), error.message()));
  }
  const auto bytes = std::span(reinterpret_cast<const std::uint8_t*>(toml.data()), toml.size());
  fs::path file = folder / fmt::format("{:08x}-{}.toml", flash::crc32c(bytes), toml.size());
  if (const auto written = write_file_atomically(file.string(), toml); !written) {
    return unavailable(written.error());
  }
  return file;
}

// A run that is over and has its recording.
Granted<RunRecord> Service::recorded_run(RunId id) const {
  const auto found = store_->run(id);
  if (!found) {
    return unavailable(found.error());
  }
  if (!*found) {
    return refuse(operator_api::error_unknown, fmt::format("no run {}", id));
  }
  if (!is_final((*found)->state)) {
    return refuse(operator_api::error_nothing, fmt::format("run {} has not ended: {}", id, words((*found)->state)));
  }
  if ((*found)->recording.empty()) {
    return refuse(operator_api::error_nothing, fmt::format("run {} has no recording (any more)", id));
  }
  return **found;
}

// The same recording twice would count its noise as a second witness: an amendment's is that of the run that it amends.
Granted<Done> Service::check_together(const RunRecord& amended, const std::vector<RunId>& with) const {
  if (with.size() > most_together) {
    return refuse(operator_api::error_unknown, fmt::format("{} further runs, {} at most", with.size(), most_together));
  }
  std::set<RunId> known = {amended.id};
  for (const RunId id : with) {
    const auto other = recorded_run(id);
    if (!other) {
      return tl::unexpected(other.error());
    }
    if (other->serial != amended.serial) {
      return refuse(operator_api::error_unknown, fmt::format("run {} is of INS {}, run {} of INS {}", id, other->serial,
                                                             amended.id, amended.serial));
    }
    if (other->amends != 0 || other->rollback) {
      return refuse(operator_api::error_nothing,
                    fmt::format("run {} turned no gimbal: it has no recording of its own", id));
    }
    if (!known.insert(id).second) {
      return refuse(operator_api::error_unknown, fmt::format("run {} is given twice", id));
    }
  }
  return Done{};
}

Granted<RunId> Service::amend(const AmendRequest& request) {
  const auto found = recorded_run(request.run);
  if (!found) {
    return tl::unexpected(found.error());
  }
  const RunRecord& amended = *found;
  if (const auto together = check_together(amended, request.with); !together) {
    return tl::unexpected(together.error());
  }
  const auto runs = store_->runs_of_serial(amended.serial);
  if (!runs) {
    return unavailable(runs.error());
  }
  for (const RunRecord& later : *runs) {
    if (later.id > amended.id && wrote_its_set(later)) {
      return refuse(operator_api::error_nothing,
                    fmt::format("run {} is not the latest: run {} of {} has written a set since", amended.id, later.id,
                                later.started_utc));
    }
  }
  if (!amended.source.empty()) {
    return refuse(operator_api::error_nothing,
                  fmt::format("run {} is an imported recording: selfcal diagnose takes its file", amended.id));
  }
  Session* chosen = session(amended.ins);
  if (chosen == nullptr) {
    return refuse(operator_api::error_unknown, fmt::format("ins.{} is configured no more", amended.ins));
  }
  RunRecord record;
  record.user = request.user;
  record.serial = amended.serial;
  record.amends = amended.id;
  record.amends_with = request.with;
  record.dry_run = request.dry_run;
  record.force_reason = request.force_reason;
  return launch(*chosen, record, chosen->config.schedule);
}

Granted<RunId> Service::rollback(const std::string& serial, const std::string& reason, const std::string& user) {
  if (reason.empty()) {
    return refuse(operator_api::error_unknown, "a rollback needs a reason");
  }
  const auto runs = store_->runs_of_serial(serial);
  if (!runs) {
    return unavailable(runs.error());
  }
  const RunRecord* last = nullptr;
  for (const RunRecord& run : *runs) {
    if (!serial.empty() && wrote_its_set(run)) {
      last = &run;
    }
  }
  if (last == nullptr) {
    return refuse(operator_api::error_nothing, fmt::format("no completed calibration of \"{}\" is known", serial));
  }
  Session* chosen = session(last->ins);
  if (chosen == nullptr) {
    return refuse(operator_api::error_unknown, fmt::format("ins.{} is configured no more", last->ins));
  }
  const auto previous = store_->set(last->id, SetRole::previous);
  if (!previous) {
    return unavailable(previous.error());
  }
  if (!*previous) {
    return refuse(operator_api::error_nothing, fmt::format("run {} kept no former set", last->id));
  }
  RunRecord record;
  record.user = user;
  record.serial = serial;
  record.rollback = true;
  record.force_reason = reason;
  auto id = launch(*chosen, record, chosen->config.schedule);
  if (!id) {
    return id;
  }
  if (auto stored = store_->store_set(*id, SetRole::written, **previous); !stored) {
    (void)abort(last->ins, stored.error().message);
    return unavailable(stored.error());
  }
  return id;
}

Granted<Done> Service::abort(const std::string& ins, const std::string& reason) {
  Session* chosen = session(ins);
  if (ins.empty() && sessions_.size() == 1) {
    chosen = &sessions_.begin()->second;
  }
  if (chosen == nullptr) {
    return refuse(operator_api::error_unknown, fmt::format("no INS \"{}\"", ins));
  }
  if (!chosen->active()) {
    return refuse(operator_api::error_nothing, fmt::format("{}: no run in progress", chosen->config.name));
  }
  chosen->run->abort(reason);
  return Done{};
}

Granted<std::string> Service::show(RunId id) {
  const auto run = store_->run(id);
  if (!run) {
    return unavailable(run.error());
  }
  if (!*run) {
    return refuse(operator_api::error_unknown, fmt::format("no run {}", id));
  }
  auto document = run_document(*store_, **run);
  if (!document) {
    return unavailable(document.error());
  }
  return std::move(*document);
}

Granted<std::string> Service::history(const std::string& serial) {
  const auto runs = store_->runs_of_serial(serial);
  if (!runs) {
    return unavailable(runs.error());
  }
  // Limits are those of the place where the INS was calibrated last.
  const InsConfig* last = nullptr;
  for (const RunRecord& run : *runs) {
    last = run.source.empty() || !run.ins.empty() ? config_.find(run.ins) : last;
  }
  auto document = history_document(*store_, serial, last == nullptr ? Limits() : last->limit);
  if (!document) {
    return unavailable(document.error());
  }
  return std::move(*document);
}

Granted<std::string> Service::check_database() {
  const auto ok = RunStore::check(database_path(config_.state_directory));
  return ok ? std::string() : ok.error().message;
}

Granted<std::string> Service::backup_database(const std::string& name) {
  const auto path = back_up_database(config_.state_directory, name);
  if (path) {
    return path->string();
  }
  if (path.error().kind == ErrorKind::usage) {
    return refuse(operator_api::error_unknown, path.error().message);
  }
  return unavailable(path.error());
}

// Runs in progress belong to the database that would go.
Granted<std::string> Service::restore_database(const std::string& name) {
  for (const auto& [ins, other] : sessions_) {
    if (!other.active()) {
      continue;
    }
    const RunRecord& run = other.run->record();
    return refuse(operator_api::error_busy,
                  fmt::format("busy, run {} by user {} since {}", run.id, run.user, run.started_utc));
  }
  for (auto& [ins, other] : sessions_) {
    if (other.ending()) {
      other.run->report_end_at_once();
    }
    other.run.reset();  // ended ones look into the store still
  }
  store_.reset();
  const auto kept = selfcal::restore_database(config_.state_directory, name);
  auto store = RunStore::open(database_path(config_.state_directory));
  // Either the new one or, after a failure, the old one, which was open a moment ago.
  if (!store) {
    throw std::runtime_error(store.error().message);
  }
  store_ = std::move(*store);
  if (!kept) {
    const bool named = kept.error().kind != ErrorKind::usage;
    return refuse(named ? operator_api::error_unavailable : operator_api::error_unknown, kept.error().message);
  }
  journal::write(journal::Level::warning,
                 fmt::format("database restored from backup {}; the former one is {}", name, kept->string()));
  return kept->string();
}

std::vector<std::string> Service::instruments() const {
  std::vector<std::string> names;
  for (const auto& [name, unused] : sessions_) {
    names.push_back(name);
  }
  return names;
}

const RunProgress* Service::progress(const std::string& ins) const {
  const Session* chosen = session(ins);
  return chosen == nullptr || !chosen->run ? nullptr : &chosen->run->progress();
}

const RunRecord* Service::record(const std::string& ins) const {
  const Session* chosen = session(ins);
  return chosen == nullptr || !chosen->run ? nullptr : &chosen->run->record();
}

// Without asking the INS.
std::string Service::bus_words(const Session& session) const {
  const can::Link link = can::link_of(session.config.interface);
  std::string words = can::link_text(session.config.interface, link);
  if (link != can::Link::up || !session.active()) {
    return words;
  }
  const RunProgress& progress = session.run->progress();
  return progress.link_up ? words + ", the INS answers"
                          : fmt::format("{}, the link to the INS is lost ({})", words, progress.link_trouble);
}

void Service::rest_from_questions(const std::string& ins) {
  if (Session* chosen = session(ins)) {
    chosen->may_ask_from = loop_.now() + between_questions;
  }
}

// One question at a time to each INS; a run that begins meanwhile has a socket of its own, and takes no answer to this one
// for its own.
void Service::ask_bus(const std::string& ins, std::function<void(const std::string&)> done) {
  Session* chosen = session(ins);
  if (chosen == nullptr || chosen->busy() || can::link_of(chosen->config.interface) != can::Link::up) {
    return done(chosen == nullptr ? std::string() : bus_words(*chosen));
  }
  if (!chosen->question && loop_.now() < chosen->may_ask_from) {
    return done(chosen->bus_answer.empty() ? bus_words(*chosen) : chosen->bus_answer);
  }
  chosen->asking.push_back(std::move(done));
  if (chosen->question) {
    return;
  }
  chosen->may_ask_from = loop_.now() + between_questions;
  chosen->question = std::make_unique<BusQuestion>(loop_, chosen->config, [this, ins](const std::string& words) {
    loop_.after(std::chrono::nanoseconds(0), [this, ins, words] {
      if (Session* asked = session(ins)) {
        asked->question.reset();
        asked->bus_answer = words;
        for (const auto& told : std::exchange(asked->asking, {})) {
          told(words);
        }
      }
    });
  });
}

Standing Service::standing(const std::string& ins) const {
  Standing standing;
  if (const Session* chosen = session(ins)) {
    standing.bus = bus_words(*chosen);
  }
  const auto runs = store_->runs_of_serial("");
  if (!runs) {
    return standing;
  }
  for (const RunRecord& run : *runs) {
    if (run.ins != ins || !wrote_its_set(run)) {
      continue;
    }
    standing.serial = run.serial;
    standing.last_calibration = run.id;
    standing.last_calibration_utc = run.ended_utc;
    standing.last_calibration_kind = run_kind(run);
  }
  if (const auto set = store_->set(standing.last_calibration, SetRole::written); set && *set) {
    const auto coefficients = ins::decode_coefficients(**set);
    standing.set_version = coefficients ? coefficients->version : 0;
  }
  return standing;
}

}  // namespace selfcal
