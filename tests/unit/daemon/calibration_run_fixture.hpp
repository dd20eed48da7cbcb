// A run, its fake INS and estimator, a database in a temporary folder, and time that passes only when a test says so.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "daemon/run/calibration_run.hpp"
#include "tests/unit/daemon/fake_ins.hpp"
#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal::testing_support {

using namespace std::chrono_literals;

// Of every parameter, in SI: possible for each, so that the set written can be recognised.
inline constexpr double new_value = 1e-6;

// Answers after ten seconds.
class FakeEstimators : public Estimators {
 public:
  explicit FakeEstimators(Timers& timers) : timers_(timers) {}
  void start(EstimateJob, EstimateProgress, std::function<void(Expected<Estimate>)> on_done) override {
    ++jobs;
    timer_ = timers_.after(10s, [this, on_done] { on_done(answer); });
  }
  void start_running(RunningJob, RunningDone on_done) override {
    timers_.cancel(timer_);
    timer_ = timers_.after(1s, [this, on_done] { on_done(running(++running_jobs), running_cpu_s); });
  }
  void cancel() override { timers_.cancel(timer_); }

  static Estimate good() {
    Estimate estimate;
    estimate.result.value.setConstant(new_value);
    estimate.result.sigma.setConstant(0.1);
    estimate.result.determined.fill(true);
    estimate.result.plausible.fill(true);
    estimate.result_json = "{}";
    return estimate;
  }

  // Sigma halves with every one of them; met from number `met_from` on.
  Expected<RunningEstimate> running(int number) const {
    RunningEstimate estimate;
    estimate.data_s = 100.0 * number;
    estimate.value.setConstant(1.0);
    estimate.tolerance = default_tolerance();
    estimate.sigma = 16.0 * std::pow(0.5, number) * default_tolerance();
    estimate.met = number >= met_from;
    estimate.forecast = forecast;
    return estimate;
  }

  Expected<Estimate> answer = good();
  int met_from = 1000;
  Forecast forecast;
  int running_jobs = 0;
  double running_cpu_s = 1.0;
  int jobs = 0;

 private:
  Timers& timers_;
  Timers::Id timer_ = 0;
};

class Observer : public RunObserver {
 public:
  void on_state(const RunRecord& run) override { states.push_back(run.state); }
  void on_progress(const RunRecord&) override {}
  void on_warning(const RunRecord&, const std::string& text) override { warnings.push_back(text); }
  void on_finished(const RunRecord&) override { ++finished; }
  std::vector<State> states;
  std::vector<std::string> warnings;
  int finished = 0;
};

class CalibrationRunTest : public testing::Test {
 protected:
  CalibrationRunTest() {
    store_ = std::move(*RunStore::open(folder_ / "selfcal.db"));
    config_.name = std::string("bench");
    config_.interface = std::string("fake0");
    config_.drift_check_s = 30.0;
    config_.lost_after_s = 20.0;
    // Table 2 as long as the fake turns.
    schedule_ = *named_schedule("table2");
    const double shorter = FakeIns::rotation_s / schedule_.duration_s();
    for (double& dwell_s : schedule_.dwell_s) {
      dwell_s *= shorter;
    }
    schedule_.rotation_s *= shorter;
    key_ = ins_.key;
  }

  // A fresh one for each service.
  virtual InsPort& port() { return ins_; }
  void make(const RunRecord& record) {
    run_.reset();
    run_ = std::make_unique<CalibrationRun>(RunContext{timers_, *store_, port(), estimators_, observer_}, config_,
                                            schedule_, key_, record, folder_);
  }
  void begin(RunRecord record = {}) {
    record.ins = std::string("bench");
    record.id = *store_->create_run(record);
    make(record);
    run_->begin();
  }
  // As after kill -9: everything in memory is gone, the database and the folder stay.
  void restart_daemon() {
    const auto unfinished = *store_->unfinished_runs();
    ASSERT_EQ(unfinished.size(), 1u);
    make(unfinished[0]);
    run_->resume();
  }
  bool until(State state, std::chrono::nanoseconds limit = 1000s) {
    return timers_.run_until([&] { return run_->record().state == state; }, limit);
  }
  // The longest way there is, with every time-out on it, is far below an hour: beyond it is a hang.
  State end() {
    EXPECT_TRUE(timers_.run_until([&] { return is_final(run_->record().state) && observer_.finished > 0; }, 3600s))
        << "hangs in " << name(run_->record().state);
    EXPECT_THAT(*store_->unfinished_runs(), testing::IsEmpty());
    return run_->record().state;
  }
  // Status frames of somebody else, ten a second from now on.
  void forge_status(const ins::Status& status) {
    if (ins_.on_status) {
      ins_.on_status(status);
    }
    timers_.after(100ms, [this, status] { forge_status(status); });
  }
  const std::string& reason() const { return run_->record().reason; }
  bool old_set_in_force() { return ins_.in_force().version == 0; }

  const ScratchFolder scratch_;
  const std::filesystem::path& folder_ = scratch_.path();
  SimulatedTimers timers_;
  FakeIns ins_{timers_};
  FakeEstimators estimators_{timers_};
  Observer observer_;
  std::unique_ptr<RunStore> store_;
  InsConfig config_;
  Schedule schedule_;
  UnlockKey key_;
  std::unique_ptr<CalibrationRun> run_;
};

}  // namespace selfcal::testing_support
