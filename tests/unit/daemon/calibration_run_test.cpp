// The whole calibration against a fake INS, in simulated time: what the table promises, kept by the engine.
#include "daemon/calibration_run.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "protocol/flash/page.hpp"
#include "tests/unit/daemon/fake_ins.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::IsEmpty;
using testing_support::FakeIns;
using testing_support::SimulatedTimers;

// Answers after ten seconds, with bias 1 m/s^2 so that the set written can be recognised.
class FakeEstimators : public Estimators {
 public:
  explicit FakeEstimators(Timers& timers) : timers_(timers) {}
  void start(EstimateJob, EstimateProgress, std::function<void(Expected<Estimate>)> on_done) override {
    ++jobs;
    timer_ = timers_.after(10s, [this, on_done] { on_done(answer); });
  }
  void start_running(RunningJob, std::function<void(Expected<RunningEstimate>)> on_done) override {
    timers_.cancel(timer_);
    timer_ = timers_.after(1s, [this, on_done] { on_done(running(++running_jobs)); });
  }
  void cancel() override { timers_.cancel(timer_); }

  static Estimate good() {
    Estimate estimate;
    estimate.result.value.setConstant(1.0);
    estimate.result.sigma.setConstant(0.1);
    estimate.result.determined.fill(true);
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
    std::string pattern = testing::TempDir() + "calibration_run_XXXXXX";
    folder_ = mkdtemp(pattern.data());
    store_ = std::move(*RunStore::open(folder_ / "selfcal.db"));
    config_.name = std::string("bench");
    config_.interface = std::string("fake0");
    config_.drift_check_s = 30.0;
    config_.lost_after_s = 20.0;
    schedule_ = *named_schedule("table2");
    key_ = ins_.key;
  }
  ~CalibrationRunTest() override {
    run_.reset();
    std::filesystem::remove_all(folder_);
  }

  void make(const RunRecord& record) {
    run_.reset();
    run_ = std::make_unique<CalibrationRun>(RunContext{timers_, *store_, ins_, estimators_, observer_}, config_,
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
    EXPECT_THAT(*store_->unfinished_runs(), IsEmpty());
    return run_->record().state;
  }
  const std::string& reason() const { return run_->record().reason; }
  bool old_set_in_force() { return ins_.in_force().version == 0; }

  std::filesystem::path folder_;
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

TEST_F(CalibrationRunTest, RunsFromIdentificationToTheProofThatTheSetIsInForce) {
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(run_->record().exit_status, 0);
  EXPECT_EQ(ins_.in_force().version, 1u);
  EXPECT_EQ(ins_.in_force().value[0], 1.0);
  EXPECT_EQ(ins_.starts, 1);
  EXPECT_EQ(ins_.pages_read.size(), FakeIns::pages);
  EXPECT_EQ(run_->record().drift_old_m, 500.0);
  EXPECT_EQ(run_->record().drift_new_m, 50.0);
  EXPECT_EQ(observer_.finished, 1);
}

TEST_F(CalibrationRunTest, PagesArePulledWhileTheGimbalTurns) {
  begin();
  ASSERT_TRUE(until(State::draining));
  EXPECT_GE(ins_.pages_read.size(), FakeIns::pages - 2);
}

TEST_F(CalibrationRunTest, DryRunWritesNothing) {
  RunRecord record;
  record.dry_run = true;
  begin(record);
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(CalibrationRunTest, TheGateRefusesAndAReasonOpensIt) {
  estimators_.answer->objections = {"gyro_scale_y not determined"};
  estimators_.answer->result.determined[0] = false;
  begin();
  EXPECT_EQ(end(), State::refused);
  EXPECT_EQ(run_->record().exit_status, 1);
  EXPECT_THAT(reason(), HasSubstr("gyro_scale_y not determined"));
  EXPECT_TRUE(old_set_in_force());

  observer_.finished = 0;
  RunRecord forced;
  forced.force_reason = std::string("trial");
  begin(forced);
  EXPECT_EQ(end(), State::completed) << reason();
  // What was not determined stays as it was.
  EXPECT_EQ(ins_.in_force().value[0], 0.0);
  EXPECT_EQ(ins_.in_force().value[1], 1.0);
}

TEST_F(CalibrationRunTest, AWrongKeyEndsTheRun) {
  key_[0] = 77;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_EQ(run_->record().exit_status, 4);
  EXPECT_THAT(reason(), HasSubstr("invalidKey (0x35)"));
}

TEST_F(CalibrationRunTest, EveryRequestRefused) {
  ins_.refuse = 0x22;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("conditionsNotCorrect (0x22)"));
}

TEST_F(CalibrationRunTest, APageWithAWrongCrcIsFetchedAgainAndNoOther) {
  ins_.bad_pages[3] = 2;
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(std::count(ins_.pages_read.begin(), ins_.pages_read.end(), 3u), 3);
  EXPECT_EQ(ins_.pages_read.size(), FakeIns::pages + 2);
}

TEST_F(CalibrationRunTest, APageThatStaysWrongStopsTheGimbalAndEndsTheRun) {
  ins_.bad_pages[3] = 1000;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("page 3: wrong CRC"));
  EXPECT_NE(ins_.state(), ins::State::rotating);
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(CalibrationRunTest, ALinkLostForAWhileIsSurvivedInRotation) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  timers_.run_until([&] { return ins_.pages_read.size() > 5; }, 100s);
  ins_.dead = true;
  timers_.after(5s, [this] { ins_.dead = false; });
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.starts, 1);
  EXPECT_EQ(ins_.pages_read.size(), FakeIns::pages);
  ASSERT_FALSE(observer_.warnings.empty());
  EXPECT_THAT(observer_.warnings[0], HasSubstr("link lost"));
}

TEST_F(CalibrationRunTest, AnInsThatLostItsPowerInRotationEndsTheRun) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  ins_.power_cycle();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("the rotation ended before its time"));
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(CalibrationRunTest, AStuckGimbalEndsTheRun) {
  ins_.gimbal_sticks = true;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("the INS is failed"));
}

TEST_F(CalibrationRunTest, AStatusFrameAloneDoesNotEndTheRotation) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  for (int k = 0; k < 50; ++k) {   // says idle for 50 s of the rotation's 100
    timers_.run_until([] { return false; }, 1s);
    ins_.on_status({.state = ins::State::idle});
  }
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.starts, 1);
}

TEST_F(CalibrationRunTest, ANavigationCheckThatARestartBrokeOffBeginsAgain) {
  begin();
  ASSERT_TRUE(until(State::checking_old));
  timers_.run_until([] { return false; }, 10s);
  ins_.power_cycle();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(run_->record().drift_old_m, 500.0);
}

TEST_F(CalibrationRunTest, CoefficientsThatReadBackWrongAreNotCommitted) {
  ins_.loses_writes = true;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("read back are not those written"));
  ins_.power_cycle();
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(CalibrationRunTest, ASetThatIsNotInForceAfterThePowerCycleIsSaid) {
  ins_.ignores_commit = true;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("not the set written"));
}

TEST_F(CalibrationRunTest, AnotherInsInItsPlaceEndsTheRun) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  ins_.dead = true;
  timers_.after(5s, [this] {
    ins_.dead = false;
    ins_.serial = std::string("OTHER");
  });
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("INS OTHER answers"));
}

TEST_F(CalibrationRunTest, RollbackWritesTheFormerSetWithoutTurning) {
  begin();
  ASSERT_EQ(end(), State::completed);
  const auto former = **store_->set(run_->record().id, SetRole::previous);
  observer_.finished = 0;
  RunRecord record;
  record.rollback = true;
  record.serial = ins_.serial;
  record.ins = std::string("bench");
  record.id = *store_->create_run(record);
  ASSERT_TRUE(store_->store_set(record.id, SetRole::written, former));
  make(record);
  run_->begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.starts, 1);
  EXPECT_EQ(ins_.in_force().version, 2u);
  EXPECT_EQ(ins_.in_force().value[0], 0.0);
}

TEST_F(CalibrationRunTest, SigmaIsShownAndShrinksWhileTheGimbalTurns) {
  begin();
  std::vector<double> sigma;
  ASSERT_TRUE(timers_.run_until(
      [&] {
        const RunProgress& progress = run_->progress();
        if (progress.running && (sigma.empty() || progress.sigma[0] != sigma.back())) sigma.push_back(progress.sigma[0]);
        return run_->record().state == State::draining;
      },
      1000s));
  ASSERT_GE(sigma.size(), 5u);
  EXPECT_TRUE(std::is_sorted(sigma.rbegin(), sigma.rend()));
  EXPECT_EQ(run_->progress().tolerances_met, 24);   // the fifth: sigma is half the tolerance
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(estimators_.jobs, 1);
  EXPECT_FALSE(run_->record().early_end_s >= 0);
}

TEST_F(CalibrationRunTest, NoRunningEstimateWhereNoneIsWanted) {
  config_.running_estimate_s = 0.0;
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(estimators_.running_jobs, 0);
}

TEST_F(CalibrationRunTest, WhatTheScheduleCannotGiveIsSaidOnce) {
  estimators_.forecast.out_of_reach = {"gyro_scale_y"};
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(std::count_if(observer_.warnings.begin(), observer_.warnings.end(),
                          [](const std::string& text) {
                            return text.find("will not determine gyro_scale_y") != std::string::npos;
                          }),
            1);
}

class StopWhenMetTest : public CalibrationRunTest {
 protected:
  StopWhenMetTest() { estimators_.met_from = 4; }
  void begin_wanting_it(bool wanted = true) {
    RunRecord record;
    record.stop_when_met = wanted;
    begin(record);
    ins_.send_status(schedule_.duration_s());
  }
  bool was_in(State state) const {
    return std::find(observer_.states.begin(), observer_.states.end(), state) != observer_.states.end();
  }
};

TEST_F(StopWhenMetTest, TheRotationEndsEarlyAndAllElseFollows) {
  begin_wanting_it();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_TRUE(was_in(State::ending_early));
  EXPECT_EQ(ins_.starts, 1);
  EXPECT_EQ(ins_.stops, 1);
  EXPECT_LT(ins_.pages_read.size(), FakeIns::pages);
  EXPECT_EQ(ins_.pages_read.size(), ins_.pages_written());   // every page of it, none twice
  EXPECT_EQ(run_->record().early_end_s, static_cast<double>(ins_.pages_written() * flash::samples_per_page));
  EXPECT_EQ(ins_.in_force().version, 1u);
  EXPECT_EQ(estimators_.jobs, 1);
}

TEST_F(StopWhenMetTest, OnlyWhereItIsAskedFor) {
  begin_wanting_it(false);
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.stops, 0);
  EXPECT_EQ(ins_.pages_read.size(), FakeIns::pages);
}

TEST_F(StopWhenMetTest, NeverWhileTheGimbalMoves) {
  ins_.moving = true;
  begin_wanting_it();
  ASSERT_TRUE(timers_.run_until([&] { return estimators_.running_jobs >= 8; }, 1000s));
  EXPECT_EQ(run_->record().state, State::rotating);
  ins_.moving = false;
  EXPECT_TRUE(until(State::ending_early));
  EXPECT_EQ(end(), State::completed) << reason();
}

TEST_F(StopWhenMetTest, NeverWithoutAStatusFrame) {
  RunRecord record;
  record.stop_when_met = true;
  begin(record);
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.stops, 0);
}

TEST_F(StopWhenMetTest, TheStopLeavesADwellsEndAlone) {
  // One position for all the time but the last seconds: at the end of a dwell the gimbal is about to move.
  begin_wanting_it();
  ASSERT_TRUE(until(State::ending_early));
  const double elapsed = schedule_.duration_s() - run_->progress().ins.time_left_s;
  const double period = schedule_.dwell_s[0] + schedule_.rotation_s;
  const double into_position = std::fmod(elapsed, period);
  EXPECT_LT(into_position, schedule_.dwell_s[0] - 1.0);   // a status frame may be a second old
}

TEST_F(StopWhenMetTest, AKilledDaemonGoesOnEndingIt) {
  begin_wanting_it();
  ASSERT_TRUE(until(State::ending_early));
  restart_daemon();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.second_starts, 0);
  EXPECT_GE(run_->record().early_end_s, 0.0);
}

TEST_F(StopWhenMetTest, ADaemonKilledInRotationStillKnowsTheWish) {
  begin_wanting_it();
  ASSERT_TRUE(until(State::rotating));
  restart_daemon();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_TRUE(was_in(State::ending_early));
}

TEST_F(StopWhenMetTest, AnAbortMeanwhileIsAnAbort) {
  begin_wanting_it();
  ASSERT_TRUE(until(State::ending_early));
  run_->abort("test");
  EXPECT_EQ(end(), State::aborted);
  EXPECT_NE(ins_.state(), ins::State::rotating);
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(StopWhenMetTest, ALinkLostMeanwhileIsSurvivedAndOneThatIsGoneEndsTheRun) {
  begin_wanting_it();
  ASSERT_TRUE(until(State::ending_early));
  ins_.dead = true;
  timers_.after(5s, [this] { ins_.dead = false; });
  EXPECT_EQ(end(), State::completed) << reason();

  observer_.finished = 0;
  estimators_.running_jobs = 0;
  begin_wanting_it();
  ASSERT_TRUE(until(State::ending_early));
  ins_.dead = true;
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("link lost for more than 20 s"));
}

// One test for each state in which something can happen to the run.
class EachState : public CalibrationRunTest, public testing::WithParamInterface<State> {
 protected:
  bool committed() const { return GetParam() >= State::committing && GetParam() <= State::checking_new; }
};

std::string state_name(const testing::TestParamInfo<State>& info) { return std::string(name(info.param)); }

// kill -9 in this state: the next daemon goes on to the end, with one rotation.
TEST_P(EachState, ADaemonThatIsKilledGoesOn) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  restart_daemon();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.second_starts, 0);
  EXPECT_EQ(ins_.in_force().value[0], 1.0);
}

// The INS is gone for good: the run ends in the stated time, and the link is said to be why.
TEST_P(EachState, AnInsThatIsGoneEndsTheRun) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  ins_.dead = true;
  EXPECT_EQ(end(), State::failed);
  EXPECT_EQ(run_->record().exit_status, 4);
  EXPECT_THAT(reason(), HasSubstr("link lost for more than 20 s"));
  if (!committed()) {
    ins_.power_cycle();
    EXPECT_TRUE(old_set_in_force());
  }
}

// The operator's abort: never with the gimbal left turning, never between two sets.
TEST_P(EachState, AnAbortIsSafe) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  run_->abort("test");
  const State ended = end();
  EXPECT_NE(ins_.state(), ins::State::rotating);
  EXPECT_EQ(ended, committed() ? State::completed : State::aborted) << reason();
  EXPECT_EQ(ins_.in_force().version, committed() ? 1u : 0u);
}

INSTANTIATE_TEST_SUITE_P(Run, EachState,
                         testing::Values(State::connecting, State::unlocking, State::scheduling, State::starting,
                                         State::rotating, State::draining, State::estimating, State::judging,
                                         State::checking_old, State::erasing, State::writing, State::verifying,
                                         State::committing, State::resetting, State::confirming,
                                         State::checking_new),
                         state_name);

}  // namespace
}  // namespace selfcal
