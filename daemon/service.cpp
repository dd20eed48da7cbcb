#include "daemon/service.hpp"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <system_error>

#include "daemon/host/journal.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/store/database_copies.hpp"
#include "daemon/store/page_recording.hpp"
#include "daemon/store/recording_store.hpp"
#include "protocol/operator_api/names.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto publish_interval = 200ms;
constexpr unsigned publishes_per_second = 5;
constexpr auto bus_retry_interval = 5s;

}  // namespace

Expected<std::unique_ptr<Service>> Service::create(EventLoop& loop, Config config, std::string config_file) {
  std::error_code error;
  fs::create_directories(fs::path(config.state_directory) / "runs", error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", config.state_directory, error.message()));
  }
  auto lock = StateLock::take(config.state_directory);
  if (!lock) {
    return tl::unexpected(lock.error());
  }
  auto store = RunStore::open(database_path(config.state_directory));
  if (!store) {
    return tl::unexpected(store.error());
  }
  std::unique_ptr<Service> service(
      new Service(loop, std::move(config), std::move(config_file), std::move(*lock), std::move(*store)));
  if (auto ok = service->connect_bus(); !ok) {
    return tl::unexpected(ok.error());
  }
  return service;
}

Service::Service(EventLoop& loop, Config config, std::string config_file, StateLock lock,
                 std::unique_ptr<RunStore> store)
    : loop_(loop),
      config_(std::move(config)),
      config_file_(std::move(config_file)),
      lock_(std::move(lock)),
      store_(std::move(store)),
      publisher_(loop, config_.lcm_url) {
  for (const InsConfig& ins : config_.instruments) {
    sessions_[ins.name].config = ins;
  }
  loop_.before_wait([this] {
    if (bus_) {
      bus_->serve();
    }
  });
  publish();
  prune_every_hour();
}

Service::~Service() { drop_questions(); }

// Whoever waits for an answer waits on the connection, which is about to go.
void Service::drop_questions() {
  for (auto& [name, session] : sessions_) {
    session.question.reset();
    session.asking.clear();
  }
}

Expected<void> Service::connect_bus() {
  auto connection = open_bus(config_.bus);
  if (!connection) {
    return tl::unexpected(connection.error());
  }
  connection_ = std::move(*connection);
  try {
    operator_service_ = std::make_unique<OperatorService>(*connection_, *this);
  } catch (const sdbus::Error& error) {
    operator_service_.reset();
    connection_.reset();
    return fail(ErrorKind::device, fmt::format("D-Bus: name {}: {}", operator_api::bus_name, error.getMessage()));
  }
  bus_ = std::make_unique<BusPump>(loop_, *connection_, [this] { loop_.after(0ns, [this] { bus_lost(); }); });
  return {};
}

// Runs go on without operators; the bus is tried again for ever.
void Service::bus_lost() {
  if (bus_) {
    journal::write(journal::Level::warning, "D-Bus is gone: runs go on, the bus is tried again");
  }
  bus_.reset();
  drop_questions();
  try {
    operator_service_.reset();
  } catch (const sdbus::Error&) {
  }
  connection_.reset();
  loop_.after(bus_retry_interval, [this] {
    if (stopping_) {
      return;
    }
    if (connect_bus()) {
      journal::write(journal::Level::notice, "D-Bus is back");
    } else {
      bus_lost();
    }
  });
}

// A bus that has just gone shows in a failed send first.
template <typename Call>
void Service::tell_bus(Call call) {
  if (!operator_service_) {
    return;
  }
  try {
    call(*operator_service_);
  } catch (const sdbus::Error&) {
    if (bus_) {
      bus_->serve();
    }
  }
}

Service::Session* Service::session(const std::string& ins) {
  const auto found = sessions_.find(ins);
  return found == sessions_.end() ? nullptr : &found->second;
}

const Service::Session* Service::session(const std::string& ins) const {
  const auto found = sessions_.find(ins);
  return found == sessions_.end() ? nullptr : &found->second;
}

fs::path Service::run_folder(RunId run) const {
  return fs::path(config_.state_directory) / "runs" / std::to_string(run);
}

void Service::resume_unfinished() {
  const auto runs = store_->unfinished_runs();
  if (!runs) {
    return journal::write(journal::Level::error, runs.error().message);
  }
  for (RunRecord run : *runs) {
    if (!run.source.empty()) {
      begin_import(std::move(run), nullptr);
      continue;
    }
    Session* owner = session(run.ins);
    const auto attached = owner == nullptr || owner->active()
                              ? fail(ErrorKind::device, fmt::format("ins.{} is configured no more", run.ins))
                              : attach(*owner, run, run.schedule);
    if (attached) {
      owner->run->resume();
      continue;
    }
    run.state = State::failed;
    run.ended_utc = utc_now();
    run.exit_status = static_cast<int>(ErrorKind::device);
    run.reason = "could not be resumed: " + attached.error().message;
    journal::write(journal::Level::error, run.reason, {run.id, run.ins, run.serial, "failed", -1});
    if (auto stored = store_->update_run(run); !stored) {
      journal::write(journal::Level::error, stored.error().message);
    }
  }
  sweep_run_folders();
  notify_status();
}

// What a run left that had ended, but not tidied up, when the daemon was killed.
void Service::sweep_run_folders() {
  std::error_code ignored;
  for (const auto& folder : fs::directory_iterator(fs::path(config_.state_directory) / "runs", ignored)) {
    const bool in_use = std::any_of(sessions_.begin(), sessions_.end(), [&](const auto& session) {
      return session.second.active() && run_folder(session.second.run->record().id) == folder.path();
    });
    if (!in_use) {
      drop_pages(folder.path());
    }
  }
}

void Service::reload() {
  auto fresh = load_config(config_file_);
  if (!fresh) {
    return journal::write(journal::Level::error, "configuration kept as it was: " + fresh.error().message);
  }
  std::map<std::string, Session> sessions;
  for (const InsConfig& ins : fresh->instruments) {
    Session& kept = sessions[ins.name];
    if (auto node = sessions_.extract(ins.name)) {
      kept = std::move(node.mapped());
    }
    // A port is opened anew by the next run; one in use stays until then.
    if (!kept.busy()) {
      kept.run.reset();
      kept.port.reset();
    }
    kept.config = ins;
  }
  for (auto& [name, old] : sessions_) {
    if (!old.busy()) {
      continue;
    }
    journal::write(journal::Level::warning, fmt::format("ins.{} was removed, but its run goes on", name));
    sessions[name] = std::move(old);
  }
  sessions_ = std::move(sessions);
  // The folder, the bus and the channel are the process's own: they change with a restart.
  fresh->state_directory = config_.state_directory;
  fresh->bus = config_.bus;
  fresh->lcm_url = config_.lcm_url;
  config_ = std::move(*fresh);
  tell_bus([](OperatorService& service) { service.update_instruments(); });
  journal::write(journal::Level::notice, "configuration reloaded");
}

void Service::stop(std::function<void()> done) {
  stopping_ = true;
  suspending_ = 1;  // this call itself, so that nobody is last before all have been asked
  const auto one_less = [this, done = std::move(done)] {
    if (--suspending_ == 0) {
      done();
    }
  };
  for (auto& [name, session] : sessions_) {
    if (session.busy()) {
      ++suspending_;
      session.run->suspend(one_less);
    }
  }
  one_less();
}

void Service::on_state(const RunRecord& run) {
  tell_bus([&](OperatorService& service) { service.state_changed(run); });
  notify_status();
}

void Service::on_progress(const RunRecord& run) {
  tell_bus([&](OperatorService& service) { service.progress_changed(run); });
}

void Service::on_warning(const RunRecord& run, const std::string& text) {
  tell_bus([&](OperatorService& service) { service.warning(run, text); });
  publisher_.publish_alarm(run.ins, run.id, false, text);
}

void Service::on_finished(const RunRecord& run) {
  rest_from_questions(run.ins);
  tell_bus([&](OperatorService& service) { service.finished(run); });
  if (run.state == State::failed) {
    publisher_.publish_alarm(run.ins, run.id, false, run.reason);
  }
  notify_status();
  prune_recordings();
}

void Service::notify_status() {
  std::string text;
  for (const auto& [name, session] : sessions_) {
    if (!session.active()) {
      continue;
    }
    const RunRecord& run = session.run->record();
    text += fmt::format("{}{}: run {}, {}", text.empty() ? "" : "; ", name, run.id, words(run.state));
  }
  sd_notify(0, fmt::format("STATUS={}", text.empty() ? "Ready" : text).c_str());
}

// Fixed rates: an INS with a run five times a second, all else once.
void Service::publish() {
  const bool full_second = publish_count_++ % publishes_per_second == 0;
  int active = 0;
  for (const auto& [name, session] : sessions_) {
    if (session.active()) {
      ++active;
    }
    if (!session.active() && !full_second) {
      continue;
    }
    PublishedIns ins;
    ins.name = name;
    ins.state_idle = !session.active();
    if (session.run) {
      ins.serial = session.run->record().serial;
      ins.progress = &session.run->progress();
    }
    publisher_.publish_ins(ins);
    publisher_.publish_estimate(ins);
  }
  if (full_second) {
    publisher_.publish_service(static_cast<int>(sessions_.size()), active);
  }
  loop_.after(publish_interval, [this] { publish(); });
}

void Service::prune_recordings() {
  const auto pruned = selfcal::prune_recordings(*store_, {config_.recordings_quota_mib, config_.recordings_keep_days},
                                                fs::file_time_type::clock::now());
  if (!pruned) {
    return journal::write(journal::Level::warning, pruned.error().message);
  }
  for (const PrunedRecording& gone : *pruned) {
    journal::write(journal::Level::notice, fmt::format("recording {} removed: {}", gone.run.recording, gone.why),
                   {gone.run.id, gone.run.ins, gone.run.serial, "", -1});
  }
}

// Age passes without runs too.
void Service::prune_every_hour() {
  prune_recordings();
  loop_.after(1h, [this] { prune_every_hour(); });
}

}  // namespace selfcal
