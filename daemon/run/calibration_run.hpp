// One run of one INS: the engine that walks transition_table.hpp. It stores each state before the state's action, watches its
// budget, and takes the INS out of its session in the end. What an action does stands in the steps.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/host/task.hpp"
#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_client.hpp"
#include "daemon/ins/session_end.hpp"
#include "daemon/run/budget_watch.hpp"
#include "daemon/run/coefficient_steps.hpp"
#include "daemon/run/connection_steps.hpp"
#include "daemon/run/estimate_steps.hpp"
#include "daemon/run/navigation_steps.hpp"
#include "daemon/run/raw_data.hpp"
#include "daemon/run/rotation_steps.hpp"
#include "daemon/run/run_data.hpp"
#include "daemon/run/run_journal.hpp"
#include "daemon/run/running_steps.hpp"
#include "daemon/run/transition_table.hpp"

namespace selfcal {

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
  const RunRecord& record() const { return journal_.record; }
  const RunProgress& progress() const { return journal_.progress; }

 private:
  // From an event to the next step.
  void post(Event event);
  void drop_posted();
  void fire(Event event);
  const Transition* row_for(Event event) const;
  bool holds(Guard guard) const;
  void perform(Action action);
  Task<Step> step(Action action);
  Task<Done> run_step(Action action);
  void settle(const Step& step);
  bool session_lost(int nrc);
  void budget_spent(double waited_s);
  void storage_failed(const Error& error, State from);

  // To the end.
  void close_record();
  void end_session();
  void conclude();

  StepContext step_context();
  void on_status(const ins::Status& status);

  RunContext context_;
  RunJournal journal_;
  RunData data_;
  InsClient client_;
  SessionEnd session_end_;
  BudgetWatch budget_;

  RawData raw_;
  RunningSteps running_;
  RotationSteps rotation_;
  NavigationSteps navigation_;
  ConnectionSteps connection_;
  EstimateSteps estimate_;
  CoefficientSteps coefficients_;

  Task<Done> task_;
  Timers::Id event_timer_ = 0;
  std::optional<Event> pending_;
  SteadyTime lost_at_{};
  int sessions_lost_ = 0;
  bool over_ = false;
  bool suspended_ = false;
  std::function<void()> after_end_;  // of a run that ends while the daemon stops
};

}  // namespace selfcal
