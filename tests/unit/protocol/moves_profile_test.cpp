// An INS that is told each position by itself: the bytes of config/profiles/moves.toml, as what the service is told its records, and
// what does not fit together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "protocol/profile/describe.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"
#include "protocol/profile/told_as.hpp"
#include "tests/unit/protocol/profile_text.hpp"

namespace selfcal::profile {
namespace {

// A position by itself in place of a schedule.
TEST(MovesProfile, HasARecordOfAPosition) {
  const auto profile = load_profile(SELFCAL_SOURCE_DIR "/config/profiles/moves.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const Profile& p = **profile;
  ASSERT_TRUE(p.move);
  EXPECT_FALSE(p.schedule.did);
  EXPECT_EQ(p.move->routine, 0x0A21);
  EXPECT_TRUE(p.move->turning.by_angle);
  // Our outer angle is minus its inner one: -90 deg in counts of 0.1 mdeg, 24 bits, the lowest byte first.
  const auto bytes = encode(p, ins::MoveRecord{90000, 45000});
  ASSERT_TRUE(bytes);
  EXPECT_EQ(*bytes, (Bytes{0x02, 0x00, 0x60, 0x44, 0xF2, 0x30, 0x22, 0xF9}));
  EXPECT_EQ(decode_move(p, *bytes).value(), (ins::MoveRecord{90000, 45000}));
  ins::StateRecord state;
  state.moving = true;
  state.outer_deg = 12.34;
  state.inner_deg = -90.0;
  const auto read = decode_state(p, encode(p, state).value());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->moving);
  EXPECT_DOUBLE_EQ(read->outer_deg, 12.34);
  EXPECT_DOUBLE_EQ(read->inner_deg, -90.0);
  const std::string words = describe(p, Markup::markdown);
  EXPECT_THAT(words, testing::HasSubstr("A position is commanded by the start of routine 0x0A21"));
  EXPECT_THAT(words, testing::HasSubstr("within 1.5 deg of the position and stay within 0.05 deg"));
}

// Its samples streamed in the place of pages.
TEST(MovesProfile, MayStreamItsSamples) {
  const auto profile = load_profile(SELFCAL_SOURCE_DIR "/tests/fuzz/protocol/corpus/profile/moves_streamed.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const Profile& p = **profile;
  ASSERT_TRUE(p.move);
  EXPECT_EQ(p.stream.size(), 4U);
  EXPECT_EQ(p.raw.way, Raw::Way::stream);
  EXPECT_FALSE(told_directory(p));
  EXPECT_EQ(told_as(*profile)->directory.did, kept_directory);
  const std::string words = describe(p, Markup::markdown);
  EXPECT_THAT(words, testing::HasSubstr("From then on the INS streams its samples, at rest and while it turns"));
  EXPECT_THAT(words, testing::HasSubstr("it stops rotate: its last sample has then been sent"));
  EXPECT_THAT(words, testing::HasSubstr("Routine 0x0A20: stream the samples until it is stopped"));
}

// What the service is told: our own INS's records, under the INS's identifiers.
TEST(MovesProfile, IsToldAsOneWithASchedule) {
  EXPECT_EQ(told_as(built_in()), built_in());
  const auto told = told_as(load_profile(SELFCAL_SOURCE_DIR "/config/profiles/moves.toml").value());
  EXPECT_EQ(told->schedule.did, kept_schedule_did);
  EXPECT_EQ(told->state.did, 0x0A01);
  EXPECT_EQ(told->state.layout.bytes, built_in()->state.layout.bytes);
  EXPECT_EQ(told->directory.layout.bytes, built_in()->directory.layout.bytes);
  const ins::ScheduleRecord schedule{{{90000, -45000, 20000}}, 5000};
  EXPECT_EQ(decode_schedule(*told, encode(*told, schedule).value()).value(), schedule);
}

TEST(MovesProfile, WhatDoesNotFitTogetherIsRefused) {
  std::ifstream in(SELFCAL_SOURCE_DIR "/config/profiles/moves.toml");
  std::stringstream content;
  content << in.rdbuf();
  const std::string whole = content.str();
  const auto fault = [&](std::string_view was, std::string_view is) { return complaint(with(whole, was, is)); };
  ASSERT_EQ(complaint(whole), "");
  EXPECT_THAT(
      fault("[directory]",
            "[schedule]\ndid = 0x0A02\nfields.positions = { at = 0, type = \"u8\" }\nfields.rotation = { at = 1, "
            "type = \"u16\" }\neach.at = 3\neach.stride = 12\neach.count = \"positions\"\neach.fields.outer = { "
            "at = 0, type = \"i32\" }\neach.fields.inner = { at = 4, type = \"i32\" }\neach.fields.dwell = { at = "
            "8, type = \"u32\" }\n\n[directory]"),
      testing::HasSubstr("move: and a schedule (line 50): positions are told in one way"));
  const auto begin = whole.find("[move]"), end = whole.find("[directory]");
  EXPECT_THAT(complaint(whole.substr(0, begin) + whole.substr(end)),
              testing::HasSubstr("schedule: missing, and there is no move in its place"));
  EXPECT_THAT(fault("[memory]", "[stream]\n\n[memory]"),
              testing::HasSubstr("p.toml:87: stream: and another: the raw data come in one way"));
  EXPECT_THAT(fault("routine = 0x0A21", "routine = 0x0A21\ndid = 0x0A05"),
              testing::HasSubstr("p.toml:40: move.routine: and did (line 41): a move is commanded in one way"));
  EXPECT_THAT(fault("routine = 0x0A21\n", ""), testing::HasSubstr("move.did: missing, and there is no routine"));
  EXPECT_THAT(fault("routine = 0x0A21", "routine = 0x0A20"), testing::HasSubstr("routine 0x0A20 is that of"));
  EXPECT_THAT(fault("routine = 0x0A21", "did = 0x0A01"), testing::HasSubstr("0x0A01 is that of state.did already"));
  EXPECT_THAT(fault("there = \"angle\"", "there = \"time\""), testing::HasSubstr("move.there"));
  EXPECT_THAT(fault("there = \"angle\"\n", ""), testing::HasSubstr("move.there: missing"));
  EXPECT_THAT(fault("tolerance_deg = 1.5\n", ""), testing::HasSubstr("move.tolerance_deg: missing"));
  EXPECT_THAT(fault("longest_s = 60.0", "longest_s = 0"), testing::HasSubstr("move.longest_s"));
  EXPECT_THAT(fault("fields.outer = { at = 10, type = \"i16\", scale = 0.01, unit = \"deg\" }\n", ""),
              testing::HasSubstr("state.fields.outer: missing, and a move is over by angle (line 40)"));
  EXPECT_THAT(fault("fields.outer = { at = 5, type = \"i24\", scale = 0.1, unit = \"mdeg\" }\n", ""),
              testing::HasSubstr("move.fields.outer: missing"));
  EXPECT_THAT(fault("fields.outer = { at = 5", "fields.outer = { at = 3"), testing::HasSubstr("overlaps inner"));
  const std::string by_state = with(whole, "there = \"angle\"\ntolerance_deg = 1.5\n", "there = \"state\"\n");
  EXPECT_EQ(complaint(by_state), "");
  EXPECT_THAT(
      complaint(with(by_state, "fields.gimbal_moving = { at = 0, type = \"u8\", first_bit = 7, bits = 1 }\n", "")),
      testing::HasSubstr("state.fields.gimbal_moving: missing, and a move is over by state"));
}

}  // namespace
}  // namespace selfcal::profile
