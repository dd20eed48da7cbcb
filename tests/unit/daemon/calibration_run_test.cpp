// The whole calibration against a fake INS, in simulated time: what the table promises, kept by the engine.
#include <algorithm>

#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::CalibrationRunTest;
using testing_support::FakeIns;
using testing_support::new_value;

TEST_F(CalibrationRunTest, RunsFromIdentificationToTheProofThatTheSetIsInForce) {
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(run_->record().exit_status, 0);
  EXPECT_EQ(ins_.in_force().version, 1u);
  EXPECT_EQ(ins_.in_force().value[0], new_value);
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
  EXPECT_EQ(ins_.in_force().value[1], new_value);
}

// The operator may overrule the limit of a type of INS, and then reads what was overruled. What no sensor can have is
// kept out whatever the reason.
TEST_F(CalibrationRunTest, AReasonNamesWhatItOverrulesAndPushesNothingImpossible) {
  estimators_.answer->objections = {"gyro_drift_x implausible: 0.3 deg/h, limit 0.1",
                                    "accel_scale_pos_x = 7000 ppm is outside the physically possible range"};
  estimators_.answer->result.plausible[6] = false;
  RunRecord forced;
  forced.force_reason = std::string("after repair");
  begin(forced);
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.in_force().value[6], 0.0);
  EXPECT_EQ(ins_.in_force().value[3], new_value);
  for (const char* words :
       {"gyro_drift_x implausible: 0.3 deg/h, limit 0.1", "accel_scale_pos_x = 7000 ppm", "after repair"}) {
    EXPECT_THAT(observer_.warnings, testing::Contains(HasSubstr(words)));
  }
  std::vector<std::string> story;
  const auto events = store_->events(run_->record().id);
  for (const EventRecord& event : *events) {
    story.push_back(event.text);
  }
  EXPECT_THAT(story, testing::Contains("never written, the value in force stays: accel_scale_pos_x"));
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

// A page every 5 s, of which the INS keeps the newest one only; the link is lost for longer than two.
TEST_F(CalibrationRunTest, PagesThatTheRingLostMeanwhileAreNamed) {
  ins_.ring = 1;
  begin();
  ASSERT_TRUE(until(State::rotating));
  timers_.run_until([&] { return ins_.pages_read.size() > 5; }, 100s);
  ins_.dead = true;
  timers_.after(12s, [this] { ins_.dead = false; });
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), testing::MatchesRegex(".*page 6 is lost: the ring of the INS holds pages ([78]) to [78].*"));
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(CalibrationRunTest, AnInsThatLostItsPowerInRotationEndsTheRun) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  ins_.power_cycle();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("the rotation ended before its time"));
  EXPECT_TRUE(old_set_in_force());
}

// It was complete for an instant, and idle when it was asked: all data are in its FLASH.
TEST_F(CalibrationRunTest, AnInsThatLostItsPowerJustAfterTheRotationIsTakenUp) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  timers_.run_until([&] { return ins_.state() == ins::State::complete; }, 200s);
  ASSERT_EQ(run_->record().state, State::rotating);
  ins_.power_cycle();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.starts, 1);
}

TEST_F(CalibrationRunTest, APowerLossInRotationGivesItsReason) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  timers_.run_until([] { return false; }, 20s);
  ins_.dead = true;
  timers_.after(5s, [this] {
    ins_.power_cycle();
    ins_.dead = false;
  });
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("the rotation is lost: the INS is idle when it answers again"));
}

TEST_F(CalibrationRunTest, ARestartFasterThanATimeOutIsTakenUp) {
  begin();
  ASSERT_TRUE(until(State::estimating));
  ins_.power_cycle();  // locked again, and no request went unanswered
  EXPECT_EQ(end(), State::completed) << reason();
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
  for (int k = 0; k < 50; ++k) {  // says idle for 50 s of the rotation's 100
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

// The estimate of an amendment is the only thing that it does instead of rotating: all that follows is a calibration's.
TEST_F(CalibrationRunTest, AmendmentEstimatesAgainAndWritesWithoutTurning) {
  RunRecord record;
  record.amends = 7;
  record.serial = ins_.serial;
  estimators_.answer->notes = {"accel_relaxation, 100 sigma"};
  begin(record);
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.starts, 0);
  EXPECT_EQ(estimators_.jobs, 1);
  EXPECT_EQ(ins_.in_force().value[0], new_value);
  EXPECT_GE(run_->record().drift_new_m, 0.0);
  const auto events = *store_->events(run_->record().id);
  EXPECT_TRUE(std::any_of(events.begin(), events.end(), [](const EventRecord& event) {
    return event.kind == "amendment" && event.text == "accel_relaxation, 100 sigma";
  }));
}

TEST_F(CalibrationRunTest, AmendmentThatTheGateRefusesWritesNothing) {
  RunRecord record;
  record.amends = 7;
  estimators_.answer->objections = {"nothing in the catalogue explains run 7"};
  begin(record);
  EXPECT_EQ(end(), State::refused);
  EXPECT_TRUE(old_set_in_force());
  EXPECT_THAT(reason(), HasSubstr("nothing in the catalogue explains run 7"));
}

TEST_F(CalibrationRunTest, AmendmentGoesOnAfterTheDaemonWasKilled) {
  RunRecord record;
  record.amends = 7;
  begin(record);
  ASSERT_TRUE(until(State::estimating));
  restart_daemon();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.starts, 0);
}

TEST_F(CalibrationRunTest, AmendmentOfAnotherInsEndsBeforeAnythingIsDone) {
  RunRecord record;
  record.amends = 7;
  record.serial = std::string("OTHER");
  begin(record);
  EXPECT_EQ(end(), State::failed);
  EXPECT_EQ(estimators_.jobs, 0);
  EXPECT_TRUE(old_set_in_force());
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
  EXPECT_EQ(ins_.in_force().value[0], new_value);
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
  EXPECT_NE(ins_.state(), ins::State::checking);
  EXPECT_EQ(ended, committed() ? State::completed : State::aborted) << reason();
  EXPECT_EQ(ins_.in_force().version, committed() ? 1u : 0u);
}

INSTANTIATE_TEST_SUITE_P(Run, EachState,
                         testing::Values(State::connecting, State::unlocking, State::scheduling, State::starting,
                                         State::rotating, State::draining, State::estimating, State::judging,
                                         State::checking_old, State::erasing, State::writing, State::verifying,
                                         State::committing, State::resetting, State::confirming, State::checking_new),
                         state_name);

}  // namespace
}  // namespace selfcal
