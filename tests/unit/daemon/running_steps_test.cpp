// The estimate that runs along with the rotation, as the run shows it, and the rotation's early end.
#include <algorithm>

#include "protocol/flash/page.hpp"
#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::CalibrationRunTest;
using testing_support::FakeIns;

// An estimate needs more data than the fake's 100 s: here its clock runs 29.4 times faster, and they hold all of Table 2.
class RunningStepsTest : public CalibrationRunTest {
 protected:
  RunningStepsTest() {
    schedule_ = *named_schedule("table2");
    config_.time_scale = schedule_.duration_s() / FakeIns::rotation_s;
    config_.drift_check_s = 0.0;  // the fake's check knows no other clock
    ins_.sample_rate_hz = FakeIns::pages * flash::samples_per_page / schedule_.duration_s();
  }
};

TEST_F(RunningStepsTest, SigmaIsShownAndShrinksWhileTheGimbalTurns) {
  begin();
  std::vector<double> sigma;
  ASSERT_TRUE(timers_.run_until(
      [&] {
        const RunProgress& progress = run_->progress();
        if (progress.running && (sigma.empty() || progress.sigma[0] != sigma.back())) {
          sigma.push_back(progress.sigma[0]);
        }
        return run_->record().state == State::draining;
      },
      1000s));
  ASSERT_GE(sigma.size(), 5u);
  EXPECT_TRUE(std::is_sorted(sigma.rbegin(), sigma.rend()));
  EXPECT_EQ(run_->progress().tolerances_met, 24);  // the fifth: sigma is half the tolerance
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(estimators_.jobs, 1);
  EXPECT_FALSE(run_->record().early_end_s >= 0);
}

// 100 s of rotation; an estimate that takes 10 s of a processor may come every 41 s (1 s of the fake's, 40 of pause).
TEST_F(RunningStepsTest, RunningEstimatesTakeAFifthOfAProcessorAtMost) {
  estimators_.running_cpu_s = 10.0;
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_GE(estimators_.running_jobs, 2);
  EXPECT_LE(estimators_.running_jobs, 3);
}

TEST_F(RunningStepsTest, NoRunningEstimateWhereNoneIsWanted) {
  config_.running_estimate_s = 0.0;
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(estimators_.running_jobs, 0);
}

TEST_F(RunningStepsTest, WhatTheScheduleCannotGiveIsSaidOnce) {
  estimators_.forecast.out_of_reach = {"gyro_scale_y"};
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(std::count_if(observer_.warnings.begin(), observer_.warnings.end(),
                          [](const std::string& text) {
                            return text.find("will not determine gyro_scale_y") != std::string::npos;
                          }),
            1);
}

class StopWhenMetTest : public RunningStepsTest {
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
  EXPECT_EQ(ins_.pages_read.size(), ins_.pages_written());  // every page of it, none twice
  EXPECT_DOUBLE_EQ(run_->record().early_end_s,
                   static_cast<double>(ins_.pages_written() * flash::samples_per_page) / ins_.sample_rate_hz);
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
  EXPECT_LT(into_position, schedule_.dwell_s[0] - 1.0);  // a status frame may be a second old
}

// Frames of somebody else, who says at every time that the gimbal stands 2 s into the first position. The INS answers where
// it is; it is not stopped, and that is said once.
TEST_F(StopWhenMetTest, NotOnTheWordOfAForgedStatusFrame) {
  RunRecord record;
  record.stop_when_met = true;
  begin(record);
  ins::Status first_dwell;
  first_dwell.state = ins::State::rotating;
  first_dwell.position = 1;
  first_dwell.time_left_s = schedule_.duration_s() - 2.0;
  ASSERT_TRUE(until(State::rotating));
  forge_status(first_dwell);
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.stops, 0);
  const auto events = *store_->events(run_->record().id);
  EXPECT_EQ(std::count_if(events.begin(), events.end(),
                          [](const EventRecord& event) {
                            return event.text.find("not ended early on their word") != std::string::npos;
                          }),
            1);
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

}  // namespace
}  // namespace selfcal
