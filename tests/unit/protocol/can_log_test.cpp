#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <sstream>

#include "protocol/can/bus_event.hpp"
#include "protocol/can/bus_log.hpp"
#include "protocol/can/raw_frame.hpp"

namespace selfcal::can {
namespace {

std::string written(const LogEntry& entry) {
  std::array<char, max_log_line> buffer{};
  return std::string(format_log_line(entry.time, entry.interface, entry.frame, entry.error_frame, buffer));
}

// Lines as candump -L of can-utils writes them.
TEST(BusLog, LinesAreKeptToTheLetter) {
  for (const char* line : {"(1436509052.249713) vcan0 044#2A366C2BBA", "(0000000001.000001) can0 7FF#",
                           "(1436509052.650004) vcan0 0F6#7ADFE07BD2", "(1436509053.000001) can0 18DA10F1#0210",
                           "(1436509053.000002) can0 7E8##1112233", "(1436509053.000003) can0 123#R8",
                           "(1436509053.000004) can0 123#R", "(1436509053.000005) can0 20000040#0000000000000000"}) {
    const auto entry = parse_log_line(line);
    ASSERT_TRUE(entry) << entry.error().message;
    const std::string expected = std::string(line).starts_with("(0000000001") ? "(1.000001) can0 7FF#" : line;
    EXPECT_EQ(written(*entry), expected);
  }
}

TEST(BusLog, FieldsMeanWhatTheySay) {
  const auto entry = parse_log_line("(1436509053.000002) can0 00000123##3AABBCC");
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->time, std::chrono::seconds(1436509053) + std::chrono::microseconds(2));
  EXPECT_TRUE(entry->frame.extended);
  EXPECT_TRUE(entry->frame.fd && entry->frame.bit_rate_switch && entry->frame.error_state);
  EXPECT_EQ(entry->frame.id, 0x123U);
  EXPECT_EQ(entry->frame.size, 3);
  EXPECT_EQ(entry->frame.data[2], 0xCC);
}

TEST(BusLog, BadLinesAreRefusedWithTheirNumber) {
  for (const char* line :
       {"garbage", "(1.2) can0 123#00", "(1.000000) can0", "(1.000000) can0 12#00", "(1.000000) can0 FFF#00",
        "(1.000000) can0 123#0", "(1.000000) can0 123#001122334455667788", "(1.000000) can0 123##",
        "(1.000000) can0 123##100112233445566778899", "(1.000000) can0 123#R9", "(1.000000) can0 12G#00"}) {
    EXPECT_FALSE(parse_log_line(line)) << line;
  }
  std::istringstream log("(1.000000) can0 123#00\n\nnonsense\n");
  LogReader reader(log);
  ASSERT_TRUE(reader.next());
  const auto second = reader.next();
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("line 3"), std::string::npos) << second.error().message;
}

// Linux gives an interface 15 characters (IFNAMSIZ with its NUL); the longest line holds no more.
TEST(BusLog, AnInterfaceHasTheKernelsLength) {
  EXPECT_TRUE(parse_log_line("(1.000001) can456789012345 123#00"));
  const auto entry = parse_log_line("(1.000001) can4567890123456 123#00");
  ASSERT_FALSE(entry);
  EXPECT_NE(entry.error().message.find("at most 15 characters"), std::string::npos) << entry.error().message;
}

RC_GTEST_PROP(BusLog, ReadsBackWhatItWrote, ()) {
  LogEntry entry;
  entry.interface = "vcan0";
  entry.time = std::chrono::microseconds(*rc::gen::inRange<std::int64_t>(0, 4'000'000'000'000'000));
  CanFrame& f = entry.frame;
  f.extended = *rc::gen::arbitrary<bool>();
  f.id = *rc::gen::inRange<std::uint32_t>(0, f.extended ? 0x20000000 : 0x800);
  f.fd = *rc::gen::arbitrary<bool>();
  f.bit_rate_switch = f.fd && *rc::gen::arbitrary<bool>();
  f.size = static_cast<std::uint8_t>(size_of_dlc(*rc::gen::inRange<std::uint8_t>(0, f.fd ? 16 : 9)));
  for (std::size_t i = 0; i < f.size; ++i) {
    f.data[i] = *rc::gen::arbitrary<std::uint8_t>();
  }
  const auto read = parse_log_line(written(entry));
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->frame == entry.frame);
  RC_ASSERT(read->time == entry.time);
  canfd_frame raw{};
  const std::size_t length = to_kernel(f, raw);
  RC_ASSERT(from_kernel(raw, length) == f);
}

TEST(RawFrame, ThroughTheKernelsFormAndBack) {
  CanFrame f;
  f.id = 0x18DA10F1;
  f.extended = true;
  f.fd = true;
  f.bit_rate_switch = true;
  f.size = 12;
  f.data[11] = 0x5A;
  canfd_frame raw{};
  const std::size_t length = to_kernel(f, raw);
  EXPECT_EQ(length, CANFD_MTU);
  EXPECT_EQ(raw.can_id, 0x18DA10F1U | CAN_EFF_FLAG);
  EXPECT_EQ(from_kernel(raw, length), f);
}

TEST(BusEvent, TheGravestCauseIsReported) {
  std::array<std::uint8_t, 8> data{};
  EXPECT_EQ(decode_error_frame(CAN_ERR_BUSOFF | CAN_ERR_CRTL, data), BusEvent::bus_off);
  EXPECT_EQ(decode_error_frame(CAN_ERR_RESTARTED, data), BusEvent::restarted);
  EXPECT_EQ(decode_error_frame(CAN_ERR_ACK, data), BusEvent::not_acknowledged);
  data[1] = CAN_ERR_CRTL_TX_PASSIVE;
  EXPECT_EQ(decode_error_frame(CAN_ERR_CRTL, data), BusEvent::error_passive);
  data[1] = CAN_ERR_CRTL_RX_OVERFLOW;
  EXPECT_EQ(decode_error_frame(CAN_ERR_CRTL, data), BusEvent::controller_overrun);
  EXPECT_EQ(decode_error_frame(CAN_ERR_CRTL, {}), BusEvent::other);
}

}  // namespace
}  // namespace selfcal::can
