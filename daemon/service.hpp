// The daemon: configuration, one session for each INS, the operator interface, the publisher, all on one loop.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/host/bus_connection.hpp"
#include "daemon/host/config.hpp"
#include "daemon/host/event_loop.hpp"
#include "daemon/host/state_lock.hpp"
#include "daemon/ins/bus_question.hpp"
#include "daemon/lcm_publisher.hpp"
#include "daemon/operator_service.hpp"
#include "daemon/run/calibration_run.hpp"
#include "daemon/run/imported_run.hpp"
#include "daemon/store/run_store.hpp"

namespace selfcal {

class Service : public Operations, public RunObserver {
 public:
  // `config_file` is read again on reload().
  static Expected<std::unique_ptr<Service>> create(EventLoop& loop, Config config, std::string config_file);
  ~Service() override;

  void resume_unfinished();  // after a crash or restart
  void reload();             // runs in progress keep what they began with
  // Nothing is begun any more, every INS goes back to its default session, runs in progress stay resumable. `done` comes
  // when that is so, after 2 s at the latest.
  void stop(std::function<void()> done);

 private:
  // One configured INS. The port and the run exist from the first run on.
  struct Session {
    InsConfig config;
    std::unique_ptr<InsPort> port;
    std::unique_ptr<EstimateWorker> estimators;
    std::unique_ptr<CalibrationRun> run;
    std::unique_ptr<BusQuestion> question;
    std::vector<std::function<void(const std::string&)>> asking;  // who waits for its answer
    SteadyTime may_ask_from{};
    std::string bus_answer;  // the last one since a run
    bool active() const { return run && !is_final(run->record().state); }
    bool ending() const { return run && !active() && !run->over(); }
    bool busy() const { return active() || ending(); }
  };

  Service(EventLoop& loop, Config config, std::string config_file, StateLock lock, std::unique_ptr<RunStore> store);
  Expected<void> connect_bus();
  void bus_lost();
  void drop_questions();
  template <typename Call>
  void tell_bus(Call call);
  void publish();
  void sweep_run_folders();
  void prune_recordings();
  void prune_every_hour();
  void notify_status();
  Granted<RunId> launch(Session& session, RunRecord record, const std::string& schedule_name);
  Expected<void> attach(Session& session, RunRecord record, const std::string& schedule_name);
  std::filesystem::path run_folder(RunId run) const;
  Granted<RunRecord> recorded_run(RunId id) const;
  Granted<Done> check_together(const RunRecord& amended, const std::vector<RunId>& with) const;
  Granted<std::filesystem::path> keep_schedule(const std::string& toml) const;
  Session* session(const std::string& ins);
  const Session* session(const std::string& ins) const;

  Granted<RunId> start(const StartRequest& request) override;
  Granted<RunId> amend(const AmendRequest& request) override;
  Granted<RunId> import_run(const ImportRequest& request) override;
  void begin_import(RunRecord record, std::shared_ptr<const OpenFile> file);
  Granted<RunId> rollback(const std::string& serial, const std::string& reason, const std::string& user) override;
  Granted<Done> abort(const std::string& ins, const std::string& reason) override;
  Granted<std::string> show(RunId run) override;
  Granted<std::string> history(const std::string& serial) override;
  Granted<std::string> check_database() override;
  Granted<std::string> backup_database(const std::string& name) override;
  Granted<std::string> restore_database(const std::string& name) override;
  std::vector<std::string> instruments() const override;
  const RunProgress* progress(const std::string& ins) const override;
  const RunRecord* record(const std::string& ins) const override;
  Standing standing(const std::string& ins) const override;
  void ask_bus(const std::string& ins, std::function<void(const std::string&)> done) override;
  std::string bus_words(const Session& session) const;
  void rest_from_questions(const std::string& ins);  // its session must be able to end

  void on_state(const RunRecord& run) override;
  void on_progress(const RunRecord& run) override;
  void on_warning(const RunRecord& run, const std::string& text) override;
  void on_finished(const RunRecord& run) override;

  EventLoop& loop_;
  Config config_;
  std::string config_file_;
  StateLock lock_;
  std::unique_ptr<RunStore> store_;
  std::map<std::string, Session> sessions_;
  std::unique_ptr<ImportedRun> import_;  // one at a time
  LcmPublisher publisher_;
  std::unique_ptr<sdbus::IConnection> connection_;
  std::unique_ptr<OperatorService> operator_service_;
  std::unique_ptr<BusPump> bus_;
  unsigned publish_count_ = 0;
  bool stopping_ = false;
  std::size_t suspending_ = 0;  // runs
};

}  // namespace selfcal
