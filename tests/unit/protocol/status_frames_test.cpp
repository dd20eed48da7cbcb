// The status frames by a profile: our own against the table of the tests, and one whose signals stand otherwise by literal bytes.
#include "protocol/profile/status_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/names.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/status_frames.hpp"

namespace selfcal::profile {
namespace {

using ::testing::HasSubstr;

ins::Status any_status() {
  ins::Status status;
  status.state = static_cast<ins::State>(*rc::gen::inRange(0, 7));
  status.moving = *rc::gen::arbitrary<bool>();
  status.unlocked = *rc::gen::arbitrary<bool>();
  status.session = *rc::gen::inRange<std::uint8_t>(0, 4);
  status.faults = *rc::gen::arbitrary<std::uint8_t>();
  status.position = *rc::gen::arbitrary<std::uint8_t>();
  status.pages_written = *rc::gen::inRange<std::uint32_t>(0, 1U << 25U);  // more than 24 bits too
  status.outer_deg = *rc::gen::inRange(-720'000, 720'000) * 1e-3;
  status.inner_deg = *rc::gen::inRange(-720'000, 720'000) * 1e-3;
  status.time_left_s = *rc::gen::inRange(0, 700'000) * 1e-2;  // longer than the signal reaches too
  return status;
}

RC_GTEST_PROP(StatusFramesByProfile, OurOwnAreThoseOfTheTable, ()) {
  const ins::Status status = any_status();
  const auto alive = *rc::gen::arbitrary<std::uint8_t>();
  const auto frames = encode_status(*built_in(), status, alive, ins::can_id::status, false);
  RC_ASSERT(frames[0] == ins::encode_state_frame(status, alive, ins::can_id::status));
  RC_ASSERT(frames[1] == ins::encode_gimbal_frame(status, alive, ins::can_id::gimbal));
  ins::Status by_profile, by_table;
  for (const can::CanFrame& frame : frames) {
    RC_ASSERT(apply_status(*built_in(), frame, ins::can_id::status, false, by_profile));
    RC_ASSERT(ins::apply_status_frame(frame, by_table));
  }
  RC_ASSERT(by_profile.state == by_table.state && by_profile.moving == by_table.moving);
  RC_ASSERT(by_profile.unlocked == by_table.unlocked && by_profile.session == by_table.session);
  RC_ASSERT(by_profile.faults == by_table.faults && by_profile.position == by_table.position);
  RC_ASSERT(by_profile.pages_written == by_table.pages_written);
  for (const auto& [a, b] :
       {std::pair(by_profile.outer_deg, by_table.outer_deg), std::pair(by_profile.inner_deg, by_table.inner_deg),
        std::pair(by_profile.time_left_s, by_table.time_left_s)}) {
    RC_ASSERT(std::abs(a - b) <= 1e-9);  // of the same counts: rounding of a double alone
  }
}

// The state in the upper half of the last byte, other codes, angles big-endian with a sign, no other signal.
std::string moved() {
  std::string text(built_in_text());
  return text.replace(text.find("[status.state]"), std::string::npos, R"([status.state]
bytes = 3
signals.state = { start = 20, length = 4, byte_order = "little", codes = { starting = 9, idle = 8, rotating = 7, complete = 6, aborted = 5, failed = 4, checking = 3 } }
signals.mark = { start = 0, length = 8, byte_order = "little", constant = 0x5A }
[status.gimbal]
bytes = 5
signals.outer_angle = { start = 7, length = 16, byte_order = "big", type = "signed", scale = 0.01, unit = "deg" }
signals.inner_angle = { start = 23, length = 16, byte_order = "big", type = "signed", scale = 1e-4, unit = "rad" }
)");
}

TEST(StatusFramesByProfile, SignalsStandWhereTheProfileSays) {
  const auto profile = parse_profile(moved(), "moved.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  ins::Status status;
  status.state = ins::State::rotating;
  status.faults = 5;
  status.outer_deg = 330.0;  // 33,000 is beyond 15 bits; -30 deg: 3000 = 0x0BB8, its complement 0xF448
  status.inner_deg = 90.0;   // 15708 = 0x3D5C
  const auto frames = encode_status(**profile, status, 1, 0x123, false);
  EXPECT_EQ(std::vector(frames[0].payload().begin(), frames[0].payload().end()),
            (std::vector<std::uint8_t>{0x5A, 0, 0x70}));
  EXPECT_EQ(std::vector(frames[1].payload().begin(), frames[1].payload().end()),
            (std::vector<std::uint8_t>{0xF4, 0x48, 0x3D, 0x5C, 0}));
  EXPECT_EQ(frames[1].id, 0x124U);
  ins::Status read;
  read.faults = 2;
  EXPECT_TRUE(apply_status(**profile, frames[0], 0x123, false, read));
  EXPECT_TRUE(apply_status(**profile, frames[1], 0x123, false, read));
  EXPECT_EQ(read.state, ins::State::rotating);
  EXPECT_EQ(read.faults, 2);  // is not told
  EXPECT_NEAR(read.outer_deg, 330.0, 1e-9);
  EXPECT_NEAR(read.inner_deg, 90.0, 0.5e-4 * 180.0 / M_PI + 1e-9);  // half a count

  can::CanFrame wrong = frames[0];
  wrong.data[0] = 0x5B;
  EXPECT_FALSE(apply_status(**profile, wrong, 0x123, false, read));  // the constant
  wrong = frames[0];
  wrong.data[2] = 0x10;
  EXPECT_FALSE(apply_status(**profile, wrong, 0x123, false, read));  // no such code
  EXPECT_FALSE(apply_status(**profile, frames[0], 0x124, false, read));
  EXPECT_FALSE(apply_status(**profile, frames[0], 0x123, true, read));
  wrong = frames[0];
  wrong.size = 8;
  EXPECT_FALSE(apply_status(**profile, wrong, 0x123, false, read));
  EXPECT_EQ(read.state, ins::State::rotating);
}

// Its outer angle is our inner one, and the other the other way round: gimbal = ["-inner", "outer"].
TEST(StatusFramesByProfile, AnglesAreInTheInssAxes) {
  std::string text(built_in_text());
  const std::string straight = R"(gimbal = ["outer", "inner"])";
  text.replace(text.find(straight), straight.size(), R"(gimbal = ["-inner", "outer"])");
  const auto profile = parse_profile(text, "axes.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  ins::Status status;
  status.outer_deg = 30.0;
  status.inner_deg = 100.0;
  const auto frames = encode_status(**profile, status, 1, 0x123, false);
  const auto told = frames[1].payload();
  EXPECT_EQ(told[0] | told[1] << 8, 10000);         // outer in the INS's words: our inner
  EXPECT_EQ(told[2] | told[3] << 8, 36000 - 3000);  // inner: our outer the other way round
  ins::Status read;
  EXPECT_TRUE(apply_status(**profile, frames[1], 0x123, false, read));
  EXPECT_NEAR(read.outer_deg, 30.0, 1e-9);
  EXPECT_NEAR(read.inner_deg, 100.0, 1e-9);
}

TEST(StatusFramesByProfile, FaultsAreToldAtTheirLines) {
  std::string text = moved();
  const std::size_t at = text.find("start = 20, length = 4");
  text.replace(at, 22, "start = 4, length = 4");
  const auto profile = parse_profile(text, "moved.toml");
  ASSERT_FALSE(profile);
  EXPECT_THAT(profile.error().message, HasSubstr("status.state.signals.state: overlaps mark"));
  EXPECT_THAT(profile.error().message, HasSubstr("status.state.signals.mark: overlaps state"));
}

TEST(StatusFramesByProfile, AreToldByNameUnitAndWord) {
  const auto told = [](std::uint32_t id, std::vector<std::uint8_t> bytes) {
    can::CanFrame frame;
    frame.id = id;
    frame.size = static_cast<std::uint8_t>(bytes.size());
    std::ranges::copy(bytes, frame.data.begin());
    std::string words;
    for (const auto& signal : decoder_options(built_in()).status(frame)) {
      words += signal.name + "=" + signal.text + " ";
    }
    return words;
  };
  EXPECT_EQ(told(0x650, {0x12, 0x04, 0x13, 0x03, 0x02, 0x01, 0x00, 0xAB}),
            "State=rotating GimbalMoving=1 Unlocked=0 Session=unknown Faults=4 Position=19 PagesWritten=66051 "
            "StateAlive=171 ");
  EXPECT_EQ(told(0x651, {0x28, 0x23, 0, 0, 0x64, 0, 0, 9}),
            "OuterAngle=90 deg InnerAngle=0 deg TimeLeft=10 s GimbalAlive=9 ");
  EXPECT_EQ(told(0x652, {0, 0, 0, 0, 0, 0, 0, 0}), "");
}

}  // namespace
}  // namespace selfcal::profile
