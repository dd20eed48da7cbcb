// The INS is in its default session and locked whenever no run needs it, however the run ended (its fake keeps S3 and
// locks upon every change of session, as ISO 14229-1 has it).
#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::CalibrationRunTest;

class SessionLifetimeTest : public CalibrationRunTest {
 protected:
  // When the end is reported, not some time after it.
  void expect_locked_when_reported() {
    ASSERT_GT(observer_.finished, 0);
    EXPECT_TRUE(ins_.in_default_session());
    EXPECT_FALSE(ins_.unlocked());
    EXPECT_FALSE(ins_.session_kept());
    EXPECT_EQ(observer_.states.back(), run_->record().state);
  }
  void pass(std::chrono::nanoseconds time) {
    bool over = false;
    timers_.after(time, [&] { over = true; });
    timers_.run_until([&] { return over; }, time);
  }
};

TEST_F(SessionLifetimeTest, WhileARunNeedsItTheSessionIsKept) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  EXPECT_TRUE(ins_.unlocked());
  EXPECT_TRUE(ins_.session_kept());
  ASSERT_TRUE(until(State::judging));
  EXPECT_TRUE(ins_.unlocked());
}

TEST_F(SessionLifetimeTest, ARunThatIsDone) {
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  expect_locked_when_reported();
}

TEST_F(SessionLifetimeTest, ARunThatIsRefused) {
  estimators_.answer->objections = {"gyro_scale_y not determined"};
  begin();
  EXPECT_EQ(end(), State::refused);
  expect_locked_when_reported();
}

TEST_F(SessionLifetimeTest, ARunThatIsAborted) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  run_->abort("test");
  EXPECT_EQ(end(), State::aborted);
  expect_locked_when_reported();
}

TEST_F(SessionLifetimeTest, ARunThatFails) {
  ins_.bad_pages[3] = 1000;
  begin();
  EXPECT_EQ(end(), State::failed);
  expect_locked_when_reported();
}

TEST_F(SessionLifetimeTest, ARollback) {
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
  ASSERT_TRUE(until(State::erasing));
  EXPECT_TRUE(ins_.unlocked());
  EXPECT_EQ(end(), State::completed) << reason();
  expect_locked_when_reported();
}

// It cannot be told to; nobody keeps its session alive, so S3 ends it.
TEST_F(SessionLifetimeTest, ALinkThatIsLostForGood) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  ins_.dead = true;
  EXPECT_EQ(end(), State::failed);
  EXPECT_FALSE(ins_.session_kept());
  EXPECT_TRUE(ins_.in_default_session());
  bool said = false;
  const auto events = *store_->events(run_->record().id);
  for (const EventRecord& event : events) {
    said = said || event.text.find("did not confirm its default session") != std::string::npos;
  }
  EXPECT_TRUE(said);
}

// SIGTERM: the run is not over, but nobody may leave the INS unlocked while there is no daemon.
TEST_F(SessionLifetimeTest, ADaemonThatIsStopped) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  const SteadyTime asked = timers_.now();
  bool suspended = false;
  run_->suspend([&] { suspended = true; });
  ASSERT_TRUE(timers_.run_until([&] { return suspended; }, 10s));
  EXPECT_LE(timers_.now() - asked, 1s);
  EXPECT_TRUE(ins_.in_default_session());
  EXPECT_FALSE(ins_.unlocked());
  EXPECT_FALSE(ins_.session_kept());
  EXPECT_EQ(run_->record().state, State::rotating);
  pass(60s);  // nothing is asked any more
  EXPECT_FALSE(ins_.unlocked());
  restart_daemon();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.starts, 1);
  expect_locked_when_reported();
}

// A dead INS does not keep the daemon from stopping.
TEST_F(SessionLifetimeTest, ADaemonThatIsStoppedWhileTheLinkIsGone) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  ins_.dead = true;
  const SteadyTime asked = timers_.now();
  bool suspended = false;
  run_->suspend([&] { suspended = true; });
  ASSERT_TRUE(timers_.run_until([&] { return suspended; }, 10s));
  EXPECT_LE(timers_.now() - asked, 2s);
}

// kill -9 while estimating: the next daemon does not need the INS for ten seconds, and S3 (5 s) locks it meanwhile.
TEST_F(SessionLifetimeTest, ADaemonThatIsKilledAndRestarted) {
  begin();
  ASSERT_TRUE(until(State::estimating));
  EXPECT_TRUE(ins_.unlocked());
  restart_daemon();
  pass(6s);
  EXPECT_EQ(run_->record().state, State::estimating);
  EXPECT_FALSE(ins_.unlocked());
  EXPECT_TRUE(ins_.in_default_session());
  EXPECT_EQ(end(), State::completed) << reason();
  expect_locked_when_reported();
}

// The next run does not wait for the former one's last words, and is not harmed by them.
TEST_F(SessionLifetimeTest, ARunThatIsWantedWhileTheFormerOneEnds) {
  estimators_.answer->objections = {"gyro_scale_y not determined"};
  begin();
  ASSERT_TRUE(until(State::refused));
  ASSERT_FALSE(run_->over());
  run_->report_end_at_once();
  EXPECT_TRUE(run_->over());
  EXPECT_EQ(observer_.finished, 1);
  observer_.finished = 0;
  estimators_.answer->objections.clear();
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(observer_.finished, 1);
  expect_locked_when_reported();
}

// A run that never got to its session has none to end: no two seconds are spent on an INS that is not there.
TEST_F(SessionLifetimeTest, NobodyThere) {
  ins_.dead = true;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_TRUE(ins_.in_default_session());
}

TEST_F(SessionLifetimeTest, TimingsThatTheInsStatesAreTakenUp) {
  begin();
  ASSERT_TRUE(until(State::scheduling));
  ASSERT_TRUE(ins_.timings_taken);
  EXPECT_EQ(ins_.timings_taken->p2, 50ms);
  EXPECT_EQ(ins_.timings_taken->p2_star, 5s);
}

}  // namespace
}  // namespace selfcal
