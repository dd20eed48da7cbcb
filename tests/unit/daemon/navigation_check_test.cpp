// No run leaves the INS in a navigation check: an INS that checks refuses to rotate and to write (its fake as well).
#include <algorithm>

#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::CalibrationRunTest;
using testing_support::FakeIns;

class NavigationCheckTest : public CalibrationRunTest {
 protected:
  bool remembers(const std::string& text) {
    const auto events = *store_->events(run_->record().id);
    return std::any_of(events.begin(), events.end(),
                       [&](const EventRecord& event) { return event.text.find(text) != std::string::npos; });
  }
  // A second run right after the first, before a check left behind could be over.
  State next_run() {
    observer_.finished = 0;
    begin();
    return end();
  }
  void wait(std::chrono::nanoseconds time) {
    timers_.run_until([] { return false; }, time);
  }
};

// The check with the old set, or with the new one: how the run ends differs, what happens to the check does not.
class EitherCheck : public NavigationCheckTest, public testing::WithParamInterface<State> {
 protected:
  State expected() const { return GetParam() == State::checking_new ? State::completed : State::aborted; }
  std::uint32_t version() const { return GetParam() == State::checking_new ? 1u : 0u; }
};

TEST_P(EitherCheck, AnAbortStopsItAndTheNextRunIsNotRefused) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  wait(5s);
  run_->abort("test");
  EXPECT_EQ(end(), expected()) << reason();
  EXPECT_EQ(ins_.check_stops, 1);
  EXPECT_NE(ins_.state(), ins::State::checking);
  EXPECT_TRUE(remembers("navigation check stopped"));
  EXPECT_EQ(ins_.in_force().version, version());
  EXPECT_EQ(next_run(), State::completed) << reason();
  EXPECT_EQ(ins_.in_force().version, version() + 1);
}

TEST_P(EitherCheck, ADaemonKilledWhileEndingItEndsItAfterItsRestart) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  wait(5s);
  run_->abort("test");
  ASSERT_TRUE(until(State::ending_check));
  ASSERT_EQ(ins_.state(), ins::State::checking);  // killed before it could say so
  restart_daemon();
  EXPECT_EQ(end(), expected()) << reason();
  EXPECT_EQ(ins_.check_stops, 1);
  EXPECT_NE(ins_.state(), ins::State::checking);
  EXPECT_EQ(ins_.in_force().version, version());
}

// The operator was told that the run is being aborted: the next daemon knows it too.
TEST_P(EitherCheck, AnAbortIsKeptByADaemonThatIsKilledRightAfterIt) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  wait(5s);
  run_->abort("test");
  restart_daemon();
  EXPECT_EQ(end(), expected()) << reason();
  EXPECT_EQ(ins_.check_stops, 1);
}

TEST_P(EitherCheck, AnInsThatRestartsWhileItIsEndedHasNoneAnyMore) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  run_->abort("test");
  ASSERT_TRUE(until(State::ending_check));
  ins_.power_cycle();
  EXPECT_EQ(end(), expected()) << reason();
  EXPECT_EQ(ins_.check_stops, 0);
}

TEST_P(EitherCheck, ALinkLostWhileItIsEndedIsSurvived) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  wait(1s);
  ins_.dead = true;
  run_->abort("test");
  timers_.after(5s, [this] { ins_.dead = false; });
  EXPECT_EQ(end(), expected()) << reason();
  EXPECT_EQ(ins_.check_stops, 1);
}

TEST_P(EitherCheck, AnInsThatIsGoneWhileItIsEndedEndsTheRunInTheStatedTime) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  ins_.dead = true;
  run_->abort("test");
  const SteadyTime asked = timers_.now();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("link lost for more than 20 s"));
  // The limit, a request's time-out on either side of it, the pause between two attempts, and the two seconds for which
  // it is asked to end its session.
  EXPECT_LE(timers_.now() - asked, 25s);
}

// Some firmware knows no stop of this routine: 30 s and no more are left of it.
TEST_P(EitherCheck, OneThatCannotBeStoppedIsWaitedFor) {
  ins_.refuses_check_stop = 0x12;
  begin();
  ASSERT_TRUE(until(GetParam()));
  wait(5s);
  run_->abort("test");
  EXPECT_EQ(end(), expected()) << reason();
  EXPECT_NE(ins_.state(), ins::State::checking);
  EXPECT_TRUE(remembers("subFunctionNotSupported"));
  EXPECT_TRUE(remembers("navigation check over"));
}

// A step that fails within the check leaves none behind either. conditionsNotCorrect is the answer to everything here,
// so that the stop is refused as well; the next run finds the check, and an INS that obeys again.
TEST_P(EitherCheck, AFailureWithinItIsTheRunsReasonAndTheNextRunEndsTheCheck) {
  begin();
  ASSERT_TRUE(until(GetParam()));
  wait(5s);
  ins_.refuse = 0x22;
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("conditionsNotCorrect"));
  ins_.refuse.reset();
  ASSERT_EQ(ins_.state(), ins::State::checking);
  EXPECT_EQ(next_run(), State::completed) << reason();
  EXPECT_TRUE(remembers("navigation check that is not this run's"));
  EXPECT_EQ(ins_.check_stops, 1);
}

INSTANTIATE_TEST_SUITE_P(Run, EitherCheck, testing::Values(State::checking_old, State::checking_new),
                         [](const auto& either) { return std::string(name(either.param)); });

TEST_F(NavigationCheckTest, OneLeftByAnotherIsSaidAndEndedBeforeTheRotation) {
  ins_.begin_check();
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.check_stops, 1);
  ASSERT_FALSE(observer_.warnings.empty());
  EXPECT_THAT(observer_.warnings[0], HasSubstr("navigation check that is not this run's"));
}

TEST_F(NavigationCheckTest, OneLeftByAnotherThatCannotBeStoppedIsWaitedFor) {
  ins_.refuses_check_stop = 0x22;
  ins_.begin_check();
  begin();
  ASSERT_TRUE(until(State::scheduling));
  EXPECT_GE(timers_.now(), std::chrono::duration_cast<SteadyTime>(std::chrono::duration<double>(FakeIns::check_s)));
  EXPECT_EQ(end(), State::completed) << reason();
}

TEST_F(NavigationCheckTest, AnAbortWithoutOneStopsNone) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  run_->abort("test");
  EXPECT_EQ(end(), State::aborted);
  EXPECT_EQ(ins_.check_stops, 0);
}

}  // namespace
}  // namespace selfcal
