// Signals of plain frames: where their bits stand, by literal bytes; a DBC; and a profile of an INS that speaks no UDS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocol/profile/dbc_file.hpp"
#include "protocol/profile/describe.hpp"
#include "protocol/profile/read_profile.hpp"

namespace selfcal::profile {
namespace {

using testing::HasSubstr;
using Data = std::array<std::uint8_t, 8>;

Signal signal(std::size_t start, std::size_t length, ByteOrder order, Signal::Kind kind = Signal::Kind::whole) {
  Signal s;
  s.start = start;
  s.length = length;
  s.order = order;
  s.kind = kind;
  return s;
}

// 12 bits from bit 4 on: the high nibble of byte 0 is the lowest, byte 1 stands above it.
TEST(Signals, LittleEndianGoesUpwardsFromItsLowestBit) {
  const Signal s = signal(4, 12, ByteOrder::little);
  Data data{};
  put_raw(s, 0xABC, data);
  EXPECT_EQ(data, (Data{0xC0, 0xAB}));
  EXPECT_EQ(raw_of(s, Data{0xC5, 0xAB, 0xFF}), 0xABC);
}

// 12 bits from bit 3 of byte 0 on, downwards: the low nibble of byte 0 is the highest, byte 1 stands below it.
TEST(Signals, BigEndianGoesDownwardsFromItsHighestBit) {
  const Signal s = signal(3, 12, ByteOrder::big);
  Data data{};
  put_raw(s, 0xABC, data);
  EXPECT_EQ(data, (Data{0x0A, 0xBC}));
  EXPECT_EQ(raw_of(s, Data{0x5A, 0xBC, 0xFF}), 0xABC);
}

TEST(Signals, PutLeavesOtherBitsAlone) {
  Data data;
  data.fill(0xFF);
  put_raw(signal(15, 10, ByteOrder::big), 0, data);
  EXPECT_EQ(data, (Data{0xFF, 0x00, 0x3F, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}));
}

TEST(Signals, NumbersHaveSignScaleAndOffset) {
  Signal s = signal(0, 18, ByteOrder::little, Signal::Kind::with_sign);
  EXPECT_EQ(whole_of(s, 0x3FFFF), -1);
  EXPECT_EQ(whole_of(s, 0x20000), -131072);
  s.scale = 0.5;
  s.offset = -40.0;
  EXPECT_EQ(value_of(s, 0x3FFFE), -41.0);
  EXPECT_EQ(raw_for(s, -41.0), 0x3FFFE);
  EXPECT_EQ(raw_for(s, -40.0 + 0.5 * 131071), 131071);
  EXPECT_FALSE(raw_for(s, -40.0 + 0.5 * 131072));
  EXPECT_EQ(raw_for(s, -40.0 - 0.5 * 131072), 0x20000);
  EXPECT_FALSE(raw_for(signal(0, 8, ByteOrder::little), -1.0));
  EXPECT_FALSE(raw_for(s, std::numeric_limits<double>::quiet_NaN()));
  const Signal single = signal(0, 32, ByteOrder::little, Signal::Kind::floating);
  EXPECT_EQ(raw_for(single, 1.0), 0x3F800000);  // IEEE 754
  EXPECT_EQ(value_of(single, 0xC0000000), -2.0);
}

TEST(Dbc, TellsWhereItsSignalsStand) {
  const auto dbc = parse_dbc(
      "BU_: A B\r\n\r\nBO_ 2566844926 FAR: 8 A\r\n SG_ ONE m3 : 7|16@0- (0.25,-10) [-1|1] \"deg/s\" B\r\n"
      " SG_ TWO : 32|32@1- (1,0) [0|0] \"\" B\r\nSIG_VALTYPE_ 2566844926 TWO : 1;\r\nCM_ \"BO_ no message\";\r\n",
      "f.dbc");
  ASSERT_TRUE(dbc) << dbc.error().message;
  const DbcMessage& message = dbc->at("FAR");
  EXPECT_TRUE(message.extended);
  EXPECT_EQ(message.id, 0x18FEF1FE);
  const Signal& one = message.signals.at("ONE");
  EXPECT_EQ(std::tuple(one.start, one.length, one.order, one.scale, one.offset, one.unit),
            std::tuple(7, 16, ByteOrder::big, 0.25, -10.0, "deg/s"));
  EXPECT_EQ(message.signals.at("TWO").kind, Signal::Kind::floating);
}

TEST(Dbc, NamesTheLineThatMakesNoSense) {
  const auto fault = [](const std::string& text) {
    const auto dbc = parse_dbc(text, "f.dbc");
    return dbc ? std::string() : dbc.error().message;
  };
  EXPECT_THAT(fault("BO_ 1 A: 8 X\n SG_ S : 0|8@2+ (1,0) [0|0] \"\" Y\n"), HasSubstr("f.dbc:2: no signal"));
  EXPECT_THAT(fault("BO_ 1 A: 8 X\n SG_ S : 0|8@1+ (0,0) [0|0] \"\" Y\n"), HasSubstr("f.dbc:2: no signal"));
  EXPECT_THAT(fault(" SG_ S : 0|8@1+ (1,0) [0|0] \"\" Y\n"), HasSubstr("f.dbc:1: no signal"));
  EXPECT_THAT(fault("\nBO_ 1 A 8 X\n"), HasSubstr("f.dbc:2: no message"));
  EXPECT_THAT(fault("BO_ 1 A: 80 X\n"), HasSubstr("f.dbc:1: no message"));
  EXPECT_THAT(fault("SIG_VALTYPE_ 1 S : 1;\n"), HasSubstr("f.dbc:1: no type"));
  EXPECT_THAT(fault(std::string(3000, 'x')), HasSubstr("f.dbc:1: longer"));
}

const std::string folder = SELFCAL_SOURCE_DIR "/config/profiles/";

std::string whole_text() {
  std::ifstream in(folder + "frames.toml");
  std::stringstream content;
  content << in.rdbuf();
  return content.str();
}

std::string complaint(const std::string& text) {
  const auto profile = parse_profile(text, folder + "p.toml");
  return profile ? std::string() : profile.error().message;
}

TEST(FramesProfile, HasTheSignalsOfItsDbc) {
  const auto profile = load_profile(folder + "frames.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const Frames& frames = *(*profile)->frames;
  ASSERT_EQ(frames.samples.size(), 3);
  const auto velocities = std::ranges::find(frames.samples, "velocities", &Frame::name);
  EXPECT_EQ(velocities->id, 0x301);
  const Signal& second = *velocities->find("delta_v_y");
  EXPECT_EQ(std::tuple(second.start, second.length, second.order), std::tuple(29, 18, ByteOrder::big));
  // 0.01 deg, in radians.
  EXPECT_NEAR(value_of(*frames.move.find("outer"), 9000), 1.5707963267948966, 1e-12);
  const auto gimbal = std::ranges::find(frames.samples, "gimbal", &Frame::name);
  EXPECT_EQ(value_of(*gimbal->find("temperature"), 130), 25.0);
}

// What is written can be read again, and means the same.
TEST(FramesProfile, ItsDbcIsOne) {
  const auto profile = load_profile(folder + "frames.toml");
  ASSERT_TRUE(profile);
  const std::string text = frames_dbc(**profile);
  const auto dbc = parse_dbc(text, "own.dbc");
  ASSERT_TRUE(dbc) << dbc.error().message << text;
  const Signal& outer = dbc->at("move_read_reset_start_stop").signals.at("move_outer");
  EXPECT_EQ(std::tuple(outer.start, outer.length, outer.order, outer.scale, outer.unit),
            std::tuple(23, 16, ByteOrder::big, 0.01, "deg"));
  EXPECT_THAT(text, HasSubstr(" SG_ op M : 0|8@1+"));
  EXPECT_THAT(text, HasSubstr(" SG_ move_outer m16 : 23|16@0-"));
  EXPECT_EQ(dbc->at("state").signals.at("power_cycles").start, 16);
}

TEST(FramesProfile, TellsEveryFaultWithItsLine) {
  const std::string whole = whole_text();
  ASSERT_EQ(complaint(whole), "");
  const auto fault = [&](std::string_view was, std::string_view is) {
    std::string text = whole;
    const std::size_t at = text.find(was);
    EXPECT_NE(at, std::string::npos) << was;
    return complaint(text.replace(at, was.size(), is));
  };
  EXPECT_THAT(fault("power_cycles = { start = 16", "power_cycles = { start = 10"),
              testing::AllOf(HasSubstr("frames.state.signals.power_cycles: overlaps version (line "),
                             HasSubstr("frames.state.signals.version: overlaps power_cycles (line ")));
  EXPECT_THAT(fault("inner = { start = 48", "inner = { start = 56"),
              HasSubstr("16 bits from 56 on are not in 8 bytes"));
  EXPECT_THAT(fault("id = 0x310", "id = 0x311"), HasSubstr("0x311 is that of frames.identity already"));
  EXPECT_THAT(fault("id = 0x310", "id = 0x301"), HasSubstr("0x301 is that of frames.state already"));
  EXPECT_THAT(fault("constant = 0x20", "constant = 0x10"), HasSubstr("no constant tells them apart"));
  EXPECT_THAT(fault("id = 0x310", "id = 0x800"), HasSubstr("frames.state.id: is 2048"));
  EXPECT_THAT(fault("bytes = 6", "bytes = 9"), HasSubstr("frames.identity.bytes: is 9"));
  EXPECT_THAT(fault("message = \"INS_ANGLES\"", "message = \"ANGLES\""), HasSubstr("the DBC has no message ANGLES"));
  EXPECT_THAT(fault("of = \"ANGLE_X\"", "of = \"ANGLE\""), HasSubstr("the message has no signal ANGLE"));
  EXPECT_THAT(fault("dbc = \"frames.dbc\"", "dbc = \"none.dbc\""), HasSubstr("cannot be opened"));
  EXPECT_THAT(fault("dbc = \"frames.dbc\"\n", ""), HasSubstr("no DBC is named: frames.dbc"));
  EXPECT_THAT(fault("signals.delta_v_z", "signals.delta_v_w"), HasSubstr("no such signal; did you mean delta_v_"));
  EXPECT_THAT(fault("signals.delta_v_z = { of = \"VELOCITY_Z\" }\n", ""), HasSubstr("delta_v_z is told by no frame"));
  EXPECT_THAT(fault("signals.delta_v_z = { of = \"VELOCITY_Z\" }", "signals.delta_theta_z = { of = \"VELOCITY_Z\" }"),
              HasSubstr("delta_theta_z is told by angles already"));
  EXPECT_THAT(fault("signals.counter = { of = \"COUNT\" }\n", ""), HasSubstr("signals.counter: missing"));
  EXPECT_THAT(fault("there = \"angle\"", "there = \"time\""), HasSubstr("frames.turning.there"));
  EXPECT_THAT(fault("tolerance_deg = 1.5\n", ""), HasSubstr("frames.turning.tolerance_deg: missing"));
  EXPECT_THAT(fault("idle = 1, moving = 2", "idle = 1, moving = 1"), HasSubstr("1 is the code of idle already"));
  EXPECT_THAT(fault("failed = 15", "failed = 16"), HasSubstr("codes.failed: is 16"));
  EXPECT_THAT(fault("index = 2, type", "index = 1, type"), HasSubstr("that of coefficients.fields.accel_bias_x.index"));
  EXPECT_THAT(fault("index = 2, type = \"i32\"", "index = 2, type = \"i16\""),
              HasSubstr("i16 has 16 bits, the value of"));
  EXPECT_THAT(fault("given.sample_rate = 50.0\n", ""), HasSubstr("sample_format.fields.sample_rate: missing"));
  EXPECT_THAT(fault("[frames.told]", "[frames.answer]"),
              testing::AllOf(HasSubstr("frames.told: missing"), HasSubstr("frames.answer: no such key")));
  EXPECT_THAT(fault("[axes]", "[security]\nmethod = \"none\"\n\n[axes]"), HasSubstr("security: no such key"));
  EXPECT_THAT(fault("unit = \"deg\"", "unit = \"s\""), HasSubstr("no unit of angle: s"));
}

TEST(FramesProfile, ItsDocumentHasEverySignal) {
  const auto profile = load_profile(folder + "frames.toml");
  ASSERT_TRUE(profile);
  const std::string words = describe(**profile, Markup::markdown);
  EXPECT_THAT(words, HasSubstr("There is no ISO-TP and no UDS"));
  EXPECT_THAT(words, HasSubstr("| outer | 23 | 16 | big | signed | 0.01 deg | where the outer axis is to turn to |"));
  EXPECT_THAT(words, HasSubstr("| delta_v_y | 29 | 18 | big | signed |"));
  EXPECT_THAT(words, HasSubstr("| accel_bias_y | 2 | i32 | little | 0.001 ug |"));
}

}  // namespace
}  // namespace selfcal::profile
