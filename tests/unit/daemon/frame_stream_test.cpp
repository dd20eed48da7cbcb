// Samples in frames and moves one by one: what is lost is noticed, what is late is told, and nothing is commanded before its time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/ins/move_sequence.hpp"
#include "daemon/ins/sample_stream.hpp"
#include "protocol/profile/read_profile.hpp"

namespace selfcal {
namespace {

using testing::HasSubstr;
using Phase = MoveSequence::Phase;
using profile::FrameState;
constexpr double degree = 3.14159265358979323846 / 180.0;

class Stream : public testing::Test {
 protected:
  static profile::ProfilePtr frames() {
    auto profile = profile::load_profile(SELFCAL_SOURCE_DIR "/config/profiles/frames.toml");
    return profile ? *profile : throw std::runtime_error(profile.error().message);
  }
  can::CanFrame part(std::uint32_t id, std::uint64_t count) const {
    can::CanFrame frame;
    frame.id = id;
    frame.size = 8;
    const auto& kind = *std::ranges::find(profile_->frames->samples, id, &profile::Frame::id);
    profile::put_raw(*kind.find("counter"), count & 0xFF, std::span(frame.data).first(8));
    return frame;
  }
  bool sample(std::uint64_t count) {
    stream_.take(part(0x300, count));
    stream_.take(part(0x301, count));
    return stream_.take(part(0x302, count));
  }
  profile::ProfilePtr profile_ = frames();
  SampleStream stream_{profile_};
};

TEST_F(Stream, TakesASampleOnceAllItsFramesCame) {
  stream_.begin();
  EXPECT_FALSE(stream_.take(part(0x302, 7)));
  EXPECT_FALSE(stream_.take(part(0x300, 7)));
  EXPECT_TRUE(stream_.take(part(0x301, 7)));  // in any order
  EXPECT_EQ(stream_.samples(), 1);
}

TEST_F(Stream, ReadsWhatTheFramesSay) {
  stream_.begin();
  can::CanFrame velocities = part(0x301, 0), gimbal = part(0x302, 0);
  velocities.data[6] = 0xFF;  // VELOCITY_Z, big-endian, bits 43 down: 0x03FC0 counts
  gimbal.data[1] = 130;       // 25 degC
  gimbal.data[2] = 0x28;      // 90.00 deg
  gimbal.data[3] = 0x23;
  stream_.take(part(0x300, 0));
  stream_.take(velocities);
  ASSERT_TRUE(stream_.take(gimbal));
  EXPECT_NEAR(stream_.gimbal()[0], 90.0 * degree, 1e-9);
  const auto bytes = stream_.page(0, 5, true);
  flash::Page page;
  ASSERT_TRUE(flash::decode_page(bytes, page));
  EXPECT_EQ(page.run_id, 5);
  EXPECT_EQ(page.temperature_c, 25.0);
  ASSERT_EQ(page.samples.size(), 1);
  EXPECT_EQ(page.samples[0].delta_v[2], 0xFF << 6);
  EXPECT_EQ(page.samples[0].outer, 16384);  // a quarter of a turn
}

TEST_F(Stream, TheCounterGoesRound) {
  stream_.begin();
  for (std::uint64_t k = 0; k < 1000; ++k) {
    ASSERT_TRUE(sample(k + 200)) << stream_.trouble();
  }
  EXPECT_EQ(stream_.samples(), 1000);
  EXPECT_EQ(stream_.pages_begun(), 7);  // of 145
}

TEST_F(Stream, MayBeJoinedInTheMiddleOfASample) {
  stream_.begin();
  stream_.take(part(0x302, 9));
  EXPECT_TRUE(sample(10)) << stream_.trouble();
  EXPECT_EQ(stream_.samples(), 1);
}

TEST_F(Stream, AFrameThatIsLostEndsIt) {
  stream_.begin();
  sample(1);
  stream_.take(part(0x300, 2));
  stream_.take(part(0x302, 2));
  EXPECT_FALSE(sample(3));
  EXPECT_THAT(stream_.trouble(), HasSubstr("frame 0x301 of sample 1 did not come (counter 2, then 3)"));
  EXPECT_FALSE(sample(4));  // nothing behind it is used
  EXPECT_EQ(stream_.samples(), 1);
}

TEST_F(Stream, ASampleThatIsLostEndsIt) {
  stream_.begin();
  sample(255);
  sample(1);
  EXPECT_THAT(stream_.trouble(), HasSubstr("samples are missing behind sample 0: counter 1 came, 0 was to come"));
}

TEST_F(Stream, AFrameThatComesTwiceEndsIt) {
  stream_.begin();
  sample(1);
  stream_.take(part(0x300, 2));
  stream_.take(part(0x300, 2));
  EXPECT_THAT(stream_.trouble(), HasSubstr("frame 0x300 of sample 1 came twice"));
}

TEST_F(Stream, AFrameThatIsTooShortEndsIt) {
  stream_.begin();
  can::CanFrame frame = part(0x301, 1);
  frame.size = 7;
  stream_.take(frame);
  EXPECT_THAT(stream_.trouble(), HasSubstr("has 7 bytes, 8 expected"));
}

// Two positions, 2 s each, at 10 Hz.
class Moves : public testing::Test {
 protected:
  static ins::ScheduleRecord schedule() { return {{{0, 0, 2000}, {90000, 0, 2000}}, 1000}; }
  static profile::Turning turning(bool by_angle) { return {by_angle, 1.0 * degree, 0.05 * degree, 3.0}; }
  void begin(bool by_angle) {
    moves_.begin(schedule(), turning(by_angle));
    tell(0, FrameState::idle);
    EXPECT_EQ(moves_.phase(), Phase::approaching);  // it may have been on its way when the move was commanded
    tell(0, FrameState::idle);
    EXPECT_EQ(moves_.phase(), Phase::dwelling);
  }
  // Samples come at 10 Hz.
  bool at(int samples, double outer_deg) {
    const std::array<double, 2> gimbal{outer_deg * degree, 0.0};
    return moves_.on_time(samples / 10.0, &gimbal);
  }
  void tell(int samples, FrameState state, const std::array<double, 2>* gimbal = nullptr) {
    moves_.on_state(samples / 10.0, state, gimbal);
  }
  MoveSequence moves_;
};

TEST_F(Moves, OneAfterTheOtherByAngle) {
  begin(true);
  for (int k = 1; k < 20; ++k) {
    EXPECT_FALSE(at(k, 0.0));
  }
  EXPECT_TRUE(at(20, 0.0));  // 2 s at 10 Hz
  EXPECT_NEAR(moves_.target()[0], 90.0 * degree, 1e-12);
  EXPECT_EQ(moves_.position(), 2);
  EXPECT_FALSE(at(25, 45.0));
  EXPECT_EQ(moves_.phase(), Phase::moving);
  EXPECT_FALSE(at(29, 89.5));
  EXPECT_FALSE(at(30, 90.5));  // it rests from here on
  EXPECT_FALSE(at(31, 90.52));
  EXPECT_EQ(moves_.phase(), Phase::moving);
  EXPECT_FALSE(at(32, 90.48));  // 0.2 s later that is known
  EXPECT_EQ(moves_.phase(), Phase::dwelling);
  EXPECT_FALSE(at(49, 90.5));
  EXPECT_EQ(moves_.phase(), Phase::dwelling);
  EXPECT_FALSE(at(50, 90.5 - 360.0));  // a whole turn is none
  EXPECT_EQ(moves_.phase(), Phase::over);
}

TEST_F(Moves, OneAfterTheOtherByState) {
  begin(false);
  EXPECT_TRUE(at(20, 0.0));
  tell(21, FrameState::idle);
  tell(22, FrameState::moving);
  tell(23, FrameState::idle);
  EXPECT_EQ(moves_.phase(), Phase::moving);
  tell(25, FrameState::idle);
  EXPECT_EQ(moves_.phase(), Phase::dwelling);
  EXPECT_FALSE(at(44, 0.0));
  EXPECT_EQ(moves_.phase(), Phase::dwelling);
  EXPECT_FALSE(at(45, 0.0));
  EXPECT_EQ(moves_.phase(), Phase::over);
}

// Two dwells of 2 s and a move of 1 s; a move that takes longer leaves no less.
TEST_F(Moves, WhatIsLeftIsTheSchedules) {
  EXPECT_EQ(moves_.left_s(0.0), 0.0);
  begin(false);
  EXPECT_DOUBLE_EQ(moves_.left_s(0.0), 5.0);
  EXPECT_DOUBLE_EQ(moves_.left_s(1.5), 3.5);
  EXPECT_DOUBLE_EQ(moves_.left_s(2.5), 3.0);  // nobody has looked since
  EXPECT_TRUE(at(20, 0.0));
  EXPECT_DOUBLE_EQ(moves_.left_s(2.0), 3.0);
  EXPECT_DOUBLE_EQ(moves_.left_s(4.0), 3.0);
  tell(35, FrameState::idle);
  tell(40, FrameState::idle);
  ASSERT_EQ(moves_.phase(), Phase::dwelling);
  EXPECT_DOUBLE_EQ(moves_.left_s(4.5), 1.5);
  EXPECT_FALSE(at(60, 0.0));
  EXPECT_EQ(moves_.left_s(6.0), 0.0);
}

TEST_F(Moves, WhatIsNotReachedIsTold) {
  begin(true);
  at(20, 0.0);
  at(50, 30.0);
  EXPECT_EQ(moves_.phase(), Phase::moving);  // 3 s are not over
  at(51, 30.0);
  EXPECT_EQ(moves_.phase(), Phase::failed);
  EXPECT_THAT(moves_.why(), HasSubstr("position 2 is not reached within 3 s: the gimbal is at 30.00 and 0.00 deg"));
}

TEST_F(Moves, WhatIsLeftIsTold) {
  begin(true);
  at(20, 12.0);
  EXPECT_THAT(moves_.why(), HasSubstr("position 1 is left before its time: the gimbal is at 12.00"));
}

TEST_F(Moves, AnInsThatFailsIsTold) {
  begin(true);
  tell(3, FrameState::failed);
  EXPECT_EQ(moves_.phase(), Phase::failed);
  EXPECT_THAT(moves_.why(), HasSubstr("at position 1 the INS says that it failed"));
}

// Angles are looked at where the state frame has them, and a state before any schedule means nothing.
TEST_F(Moves, TheFirstPositionIsWaitedFor) {
  const std::array away{20.0 * degree, 0.0}, there{0.0, 0.0};
  tell(0, FrameState::idle, &there);
  EXPECT_EQ(moves_.phase(), Phase::none);
  moves_.begin(schedule(), turning(true));
  for (int k = 0; k < 5; ++k) {
    tell(0, FrameState::idle, &away);
  }
  EXPECT_EQ(moves_.phase(), Phase::approaching);
  tell(0, FrameState::idle, &there);
  tell(0, FrameState::idle, &there);
  EXPECT_EQ(moves_.phase(), Phase::dwelling);
}

// A position may be where the gimbal is already.
TEST_F(Moves, AMoveThatIsNoneIsOverWhenTheGimbalRests) {
  moves_.begin({{{0, 0, 2000}, {0, 0, 2000}}, 1000}, turning(true), 1.0);
  at(11, 0.0);
  EXPECT_EQ(moves_.phase(), Phase::approaching);
  at(12, 0.0);
  EXPECT_EQ(moves_.phase(), Phase::dwelling);
  moves_.data_begin(3.0);
  EXPECT_FALSE(at(49, 0.0));
  EXPECT_TRUE(at(50, 0.0));
  at(51, 0.0);
  EXPECT_EQ(moves_.phase(), Phase::moving);
  at(52, 0.0);
  EXPECT_EQ(moves_.phase(), Phase::dwelling);
}

// By state, where no angles are told at all.
TEST_F(Moves, WhatIsNotReachedIsToldWithoutAngles) {
  begin(false);
  EXPECT_TRUE(moves_.on_time(2.0, nullptr));
  EXPECT_FALSE(moves_.on_time(5.1, nullptr));
  EXPECT_EQ(moves_.why(), "position 2 is not reached within 3 s");
}

}  // namespace
}  // namespace selfcal
