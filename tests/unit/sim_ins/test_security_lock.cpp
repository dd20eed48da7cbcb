// SecurityAccess of the INS: what a seed is worth and for how long, and what it costs to guess.
#include <functional>

#include "tests/unit/sim_ins/diagnostics_fixture.hpp"

namespace selfcal::sim {
namespace {

class SecurityLockTest : public DiagnosticsTest {
 protected:
  void enter(uds::Session session) { ASSERT_EQ(nrc_of(uds::session_request(session)), Nrc::none); }
  void run_out() { diagnostics_->session_expired(time()); }
  std::uint32_t attempts() { return instrument_->counters().get().key_attempts; }
  // The key is on its way; the power goes `after_s` later. True: an answer came before that.
  bool answered_before_the_cut(const uds::Bytes& key, double after_s) {
    uds::Bytes response;
    EXPECT_EQ(diagnostics_->handle(key, response, time()), uds::RequestHandler::Answer::later);
    EXPECT_TRUE(response.empty());
    bool answered = false;
    constexpr double step_s = 0.0001;
    for (const double end = now_s_ + after_s; now_s_ < end;) {
      run_for(std::min(step_s, end - now_s_));
      answered = diagnostics_->take_answer().has_value() || answered;
    }
    opened_ = diagnostics_->unlocked();
    power_cycle();
    return answered;
  }
  bool opened_ = false;  // at the moment of the cut
};

TEST_F(SecurityLockTest, AKeyIsWorthNothingTheSecondTime) {
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
  const uds::Bytes key = key_for(seed());
  ASSERT_EQ(nrc_of(key), Nrc::none);
  power_cycle();
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
  EXPECT_EQ(nrc_of(key), Nrc::request_sequence_error);
  ASSERT_FALSE(seed().empty());
  EXPECT_EQ(nrc_of(key), Nrc::invalid_key);
}

TEST_F(SecurityLockTest, ThreeWrongKeysDelayEvenOverAReset) {
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
  const uds::Bytes wrong = uds::key_request(uds::Bytes(16, 0));
  for (const Nrc expected : {Nrc::invalid_key, Nrc::invalid_key, Nrc::exceeded_number_of_attempts}) {
    ASSERT_FALSE(seed().empty());
    EXPECT_EQ(nrc_of(wrong), expected);
  }
  EXPECT_EQ(nrc_of(uds::seed_request()), Nrc::required_time_delay_not_expired);
  power_cycle();
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
  EXPECT_EQ(nrc_of(uds::seed_request()), Nrc::required_time_delay_not_expired);
  run_for(10.5);
  unlock();
}

// ISO 14229-1, 9.2.1: every transition into a session, the one it is in included, locks again.
TEST_F(SecurityLockTest, EverySessionRequestLocksAgain) {
  for (const uds::Session session : {uds::Session::extended, uds::Session::programming, uds::Session::standard}) {
    unlock();
    enter(session);
    EXPECT_FALSE(diagnostics_->unlocked()) << static_cast<int>(session);
  }
}

// A seed belongs to the session in which it was given: any end of that makes its key worthless.
TEST_F(SecurityLockTest, ASeedDiesWithItsSession) {
  const std::array<std::function<void()>, 5> ends{
      [this] { enter(uds::Session::extended); },     // entered anew
      [this] { enter(uds::Session::programming); },  // another one
      [this] {
        enter(uds::Session::standard);
        enter(uds::Session::extended);
      },
      [this] {
        run_out();
        enter(uds::Session::extended);
      },
      [this] {
        power_cycle();
        enter(uds::Session::extended);
      },
  };
  for (std::size_t i = 0; i < ends.size(); ++i) {
    enter(uds::Session::extended);
    const uds::Bytes key = key_for(seed());
    ends[i]();
    EXPECT_EQ(nrc_of(key), Nrc::request_sequence_error) << "end " << i;
    EXPECT_FALSE(diagnostics_->unlocked()) << "end " << i;
  }
  EXPECT_EQ(attempts(), 0U);  // none of these was an attempt
}

// Counting and judging are two writes of 45.8 ms each (a block erased, 16 bytes programmed). Wherever the power goes: an
// attempt of which anything was seen is counted, and before it is counted nothing depends on the key.
TEST_F(SecurityLockTest, APowerCutMakesNoAttemptFree) {
  constexpr double both_writes_s = 2 * (0.045 + 0.0008);
  int counted = 0;
  for (double cut_s = 0.0; cut_s < both_writes_s + 0.002; cut_s += 0.0005) {
    for (const bool right : {false, true}) {
      instrument_->counters().set(1, 0);
      run_for(0.2);
      enter(uds::Session::extended);
      const uds::Bytes given = seed();
      const bool answered =
          answered_before_the_cut(right ? key_for(given) : uds::key_request(uds::Bytes(16, 0)), cut_s);
      EXPECT_EQ(answered, cut_s >= both_writes_s) << cut_s;
      EXPECT_EQ(opened_, answered && right) << cut_s;
      if (!right) {
        EXPECT_TRUE(!answered || attempts() == 1) << cut_s;
        counted += static_cast<int>(attempts());
      } else if (answered) {
        EXPECT_EQ(attempts(), 0U) << cut_s;
      }
      // An attempt that left no trace was cut before its key was looked at, which the first write ends.
      EXPECT_TRUE(attempts() == 1 || cut_s < both_writes_s / 2 + 0.0001 || (right && answered)) << cut_s;
    }
  }
  EXPECT_GT(counted, 90);  // of 188 moments, those after the first write
}

// The attack: as many wrong keys as one likes, each followed by the power switch. After the third that was counted the
// INS gives no seed for ten seconds; those cut off earlier told nothing.
TEST_F(SecurityLockTest, TheThirdCountedAttemptDelaysWhateverThePowerDoes) {
  int seeds = 0;
  for (int k = 0; k < 12; ++k) {
    enter(uds::Session::extended);
    if (nrc_of(uds::seed_request()) == Nrc::required_time_delay_not_expired) {
      continue;
    }
    ++seeds;
    EXPECT_FALSE(answered_before_the_cut(uds::key_request(uds::Bytes(16, 0)), 0.050));
  }
  EXPECT_EQ(seeds, 3);
  EXPECT_EQ(attempts(), 3U);
}

TEST_F(SecurityLockTest, ARightKeyTakesAsLongAsAWrongOne) {
  const auto seconds = [&](bool right) {
    enter(uds::Session::extended);
    const uds::Bytes given = seed();
    const uds::Bytes key = right ? key_for(given) : uds::key_request(uds::Bytes(16, 0));
    const double begin = now_s_;
    EXPECT_EQ(nrc_of(key), right ? Nrc::none : Nrc::invalid_key);
    return now_s_ - begin;
  };
  const double wrong = seconds(false);
  constexpr double step_s = 0.0001;                  // of ask()
  EXPECT_NEAR(seconds(true), wrong, 1.01 * step_s);  // with a count to be cleared
  EXPECT_NEAR(seconds(true), wrong, 1.01 * step_s);  // and without
  EXPECT_NEAR(wrong, 2 * 0.0458, 2.02 * step_s);
}

}  // namespace
}  // namespace selfcal::sim
