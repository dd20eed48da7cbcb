// One run of one INS: the engine that walks transition_table.hpp. It stores each state before the state's action,
// and it is the only writer of its row.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/host/config.hpp"
#include "daemon/host/task.hpp"
#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_client.hpp"
#include "daemon/ins/session_end.hpp"
#include "daemon/run/budget_watch.hpp"
#include "daemon/run/rotation_clock.hpp"
#include "daemon/run/running_estimates.hpp"
#include "daemon/run/transition_table.hpp"
#include "daemon/store/page_file.hpp"
#include "daemon/store/run_store.hpp"
#include "estimator/geometry/schedule.hpp"
#include "protocol/document/summary.hpp"

namespace selfcal {

// What an onlooker may know about a run, at any time.
struct RunProgress {
  RunId run = 0;
  State state = State::connecting;
  ins::Status ins;  // as last reported
  int positions = 0;
  std::uint32_t pages_pulled = 0;
  std::uint32_t pages_expected = 0;
  std::uint32_t pages_refetched = 0;  // for a wrong CRC
  int pass = 0;
  double pass_fraction = 0.0;
  bool estimate_known = false;
  std::array<double, sensor_parameter_count> value{}, sigma{}, tolerance{};  // in the unit of sensor_parameters
  int tolerances_met = 0;     // parameters whose sigma is below its tolerance
  bool running = false;       // the estimate is one of data that still come
  double data_s = 0.0;        // then: it is made of so much
  double met_at_s = -1.0;     // and every tolerance is foreseen to be met so far into the schedule; -1: not
  double finish_in_s = -1.0;  // until the rotation ends, on the operator's clock; -1: it does not turn
  bool link_up = true;
  std::string link_trouble;  // why the last request had no answer
  std::uint64_t lost_frames = 0;
  Summary summary;  // of the run, once it has ended; empty sentences before
};

class RunObserver {
 public:
  virtual ~RunObserver() = default;
  virtual void on_state(const RunRecord& run) = 0;
  virtual void on_progress(const RunRecord& run) = 0;
  virtual void on_warning(const RunRecord& run, const std::string& text) = 0;
  virtual void on_finished(const RunRecord& run) = 0;  // the run may be destroyed later, from the loop
};

// All that a run needs; outlives it.
struct RunContext {
  Timers& timers;
  RunStore& store;
  InsPort& port;
  Estimators& estimators;
  RunObserver& observer;
};

class CalibrationRun {
 public:
  // A new run (record.state connecting) or one found unfinished in the database. `folder` is its own.
  CalibrationRun(RunContext context, InsConfig config, Schedule schedule, UnlockKey key, RunRecord record,
                 std::filesystem::path folder);
  ~CalibrationRun();
  CalibrationRun(const CalibrationRun&) = delete;
  CalibrationRun& operator=(const CalibrationRun&) = delete;

  void begin();   // a new run
  void resume();  // after a restart of the daemon
  void abort(const std::string& reason);
  // The daemon stops: the INS goes back to its default session, the run stays as it is and can be resumed.
  void suspend(std::function<void()> done);
  // Its end has been reported. A run whose state is final before that is taking the INS out of its session.
  bool over() const { return over_; }
  // Reports the end of such a run now: the next run needs the INS, and a session of its own.
  void report_end_at_once();
  const RunRecord& record() const { return record_; }
  const RunProgress& progress() const { return progress_; }

 private:
  using Step = Answer<Event>;

  void progressed();  // the budget of the state begins anew
  void budget_spent(double waited_s);
  std::string what_the_ins_holds() const;

  void post(Event event);
  void fire(Event event);
  bool holds(Guard guard) const;
  void perform(Action action);
  Task<Step> step(Action action);
  Task<Done> run_step(Action action);
  void settle(const Step& step);
  void end_session();
  void conclude();
  void remember(const std::string& kind, const std::string& text);
  void fail_with(const std::string& reason, ErrorKind kind = ErrorKind::device);
  void storage_failed(const Error& error, State from);
  void report_progress(bool at_once = false);

  void warn(const std::string& text);
  void on_status(const ins::Status& status);
  void on_bus_event(can::BusEvent event);
  void sum_up_bus_events();
  std::chrono::nanoseconds ins_time(double seconds) const;  // real time in which the INS's clock runs so long

  // Steps, in the order of the table; each answers with the event that follows.
  Task<Step> identify();
  Task<Step> unlock();
  Task<Step> write_schedule();
  Task<Step> start_rotation();
  Task<Step> follow_rotation();
  Task<Step> end_rotation_early();
  Task<Step> pull_last_pages();
  Task<Step> measure_drift(double RunRecord::*figure);
  Task<Step> erase_inactive_slot();
  Task<Step> write_set();
  Task<Step> read_back();
  Task<Step> commit();
  Task<Step> reset_ins();
  Task<Step> read_in_force();
  Task<Step> end_check();
  Task<Step> stop_gimbal();
  Task<Step> recover_link();

  // Parts of steps.
  Task<Answer<Done>> check_serial();
  Task<Answer<ins::StateRecord>> ask_state();  // and takes it for the time that the rotation takes
  // The INS's state and the set in force.
  Task<Answer<Done>> take_stock();
  Task<Answer<Done>> confirm_identity(
      std::string before);  // the same INS, not switched off since: before it is changed
  Answer<Done> check_power_cycles(std::uint32_t found, std::string_view when);
  Task<Answer<Done>> look_for_data();
  Task<Answer<ins::DirectoryRecord>> read_checked_directory();
  Answer<Done> check_ring(const ins::DirectoryRecord& directory);
  Task<Answer<Done>> learn_pages_written();
  Task<Answer<Done>> await_completion();
  Task<Answer<bool>> confirm_standing();
  Task<Answer<Done>> check_erased();
  Task<Answer<Done>> check_space();
  Task<Answer<Done>> poll_state();
  Task<Answer<Done>> open_pages();
  Task<Answer<Done>> pull(std::uint32_t end);  // what is missing below `end`, once
  Task<Answer<Done>> bring_to_rest();
  Task<Answer<Done>> stop_check();  // whoever began it; without one nothing is done
  Task<Answer<Done>> await_state(ins::State unwanted, double limit_s, std::string what);
  tl::unexpected<PortError> senseless(const std::string& message) const;  // begins it with the interface
  tl::unexpected<PortError> local_trouble(const Error& error) const;      // disk or database, not the INS
  void note_bad_page(std::uint32_t page, const std::string& why);
  void estimate();
  std::filesystem::path amended_recording() const;
  void judge();
  void estimate_meanwhile();
  void on_running_estimate(const Expected<RunningEstimate>& answer, double data_s, bool first_met);
  bool may_end_early() const;
  void show_estimate(const ParameterVector& value, const ParameterVector& sigma);
  void foresee_finish();
  void on_estimate_progress(const CalibrationProgress& progress);
  void on_estimate(Expected<Estimate> answer);
  Expected<void> store_result();
  Expected<void> make_new_set();
  void warn_of_history(const RunStore::Parameters& parameters);
  void close_record();
  bool session_lost(int nrc);

  RunContext context_;
  InsConfig config_;
  Schedule schedule_;
  UnlockKey key_;
  RunRecord record_;
  std::filesystem::path folder_;
  InsClient client_;
  SessionEnd session_end_;
  RunProgress progress_;

  Task<Done> task_;
  Timers::Id event_timer_ = 0;
  BudgetWatch budget_;
  std::optional<Event> pending_;
  std::optional<PageFile> pages_;
  struct BusEventCount {
    std::uint64_t count = 0;
    SteadyTime said_at{};
  };
  std::map<can::BusEvent, BusEventCount> bus_events_;
  struct BadPage {
    int times = 0;
    std::string why;
  };
  std::map<std::uint32_t, BadPage> bad_pages_;
  std::optional<Error> storage_error_;
  ins::SampleFormatRecord format_;
  std::uint32_t pages_known_ = 0;              // written, by the directory
  std::optional<std::uint32_t> power_cycles_;  // as this run knows them
  RotationClock rotation_clock_;
  std::optional<Estimate> estimate_;
  std::vector<std::string> objections_;
  ins::StateRecord stock_;  // the INS as it was found after recovery
  RunningEstimates running_;
  double page_s_ = 0.0;  // of data in a full page
  bool out_of_reach_said_ = false;
  bool contradiction_said_ = false;  // of status frames and answers
  Bytes in_force_;                   // coefficient records, as on the bus
  Bytes new_set_;
  SteadyTime lost_at_{};
  SteadyTime status_at_{};
  SteadyTime reported_at_{};
  int failure_status_ = static_cast<int>(ErrorKind::device);
  int last_nrc_ = -1;
  int sessions_lost_ = 0;
  bool data_complete_ = false;  // the FLASH holds all of the last rotation, whatever the INS has done since
  bool commit_asked_ = false;
  bool failed_ = false;
  bool storage_lost_ = false;
  bool over_ = false;
  bool suspended_ = false;
  std::function<void()> after_end_;  // of a run that ends while the daemon stops
};

}  // namespace selfcal
