#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "protocol/isotp/codec.hpp"

namespace selfcal::isotp {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::ElementsAre;

CodecError error_of(const Bytes& data) {
  const auto pdu = decode(data);
  EXPECT_FALSE(pdu);
  return pdu ? CodecError::empty : pdu.error();
}

TEST(IsotpCodec, SingleFrames) {
  const Bytes classic = {0x02, 0x10, 0x03, 0xCC, 0xCC, 0xCC, 0xCC, 0xCC};
  auto pdu = decode(classic);
  ASSERT_TRUE(pdu);
  EXPECT_THAT(std::get<SingleFrame>(*pdu).payload, ElementsAre(0x10, 0x03));

  Bytes fd = {0x00, 0x08, 1, 2, 3, 4, 5, 6, 7, 8, 0xCC, 0xCC};
  pdu = decode(fd);
  ASSERT_TRUE(pdu);
  EXPECT_THAT(std::get<SingleFrame>(*pdu).payload, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(IsotpCodec, FirstFrameWith12And32BitLengths) {
  const Bytes short_length = {0x1F, 0xFF, 1, 2, 3, 4, 5, 6};
  auto pdu = decode(short_length);
  ASSERT_TRUE(pdu);
  EXPECT_EQ(std::get<FirstFrame>(*pdu).length, 4095U);
  EXPECT_THAT(std::get<FirstFrame>(*pdu).payload, ElementsAre(1, 2, 3, 4, 5, 6));

  const Bytes long_length = {0x10, 0x00, 0x00, 0x00, 0x10, 0x00, 0xAA, 0xBB};
  pdu = decode(long_length);
  ASSERT_TRUE(pdu);
  EXPECT_EQ(std::get<FirstFrame>(*pdu).length, 4096U);
  EXPECT_THAT(std::get<FirstFrame>(*pdu).payload, ElementsAre(0xAA, 0xBB));
}

TEST(IsotpCodec, ConsecutiveAndFlowControl) {
  const Bytes consecutive = {0x2F, 9, 8};
  auto pdu = decode(consecutive);
  ASSERT_TRUE(pdu);
  EXPECT_EQ(std::get<ConsecutiveFrame>(*pdu).sequence, 15);
  EXPECT_THAT(std::get<ConsecutiveFrame>(*pdu).payload, ElementsAre(9, 8));
  const Bytes wait = {0x31, 0x08, 0xF1};
  pdu = decode(wait);
  ASSERT_TRUE(pdu);
  const auto flow = std::get<FlowControl>(*pdu);
  EXPECT_EQ(flow.status, FlowStatus::wait);
  EXPECT_EQ(flow.block_size, 8);
  EXPECT_EQ(separation_time(flow.st_min), std::chrono::microseconds(100));
}

TEST(IsotpCodec, MalformedFramesAreNamed) {
  EXPECT_EQ(error_of({}), CodecError::empty);
  EXPECT_EQ(error_of({0x00, 1, 2}), CodecError::bad_length);  // single frame of nothing
  EXPECT_EQ(error_of({0x05, 1, 2}), CodecError::truncated);
  EXPECT_EQ(error_of({0x08, 1, 2, 3, 4, 5, 6, 7}), CodecError::truncated);
  EXPECT_EQ(error_of(Bytes(12, 0x07)), CodecError::bad_length);  // long frame without the escape
  EXPECT_EQ(error_of({0x00, 11, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), CodecError::truncated);
  EXPECT_EQ(error_of({0x10, 0x07, 1, 2, 3, 4, 5, 6}), CodecError::bad_length);  // would fit a single frame
  EXPECT_EQ(error_of({0x10, 0x00, 0, 0, 0x0F, 0xFF, 1, 2}), CodecError::bad_length);
  EXPECT_EQ(error_of({0x10, 0x14, 1}), CodecError::truncated);
  EXPECT_EQ(error_of({0x21}), CodecError::truncated);
  EXPECT_EQ(error_of({0x30, 0}), CodecError::truncated);
  EXPECT_EQ(error_of({0x33, 0, 0}), CodecError::bad_flow_status);
  EXPECT_EQ(error_of({0x40, 0, 0}), CodecError::unknown_type);
}

TEST(IsotpCodec, EncodersAreLiteral) {
  Bytes out(8, 0);
  EXPECT_EQ(encode_single(Bytes{0x3E, 0x80}, out), 3U);
  EXPECT_THAT(out, ElementsAre(0x02, 0x3E, 0x80, 0, 0, 0, 0, 0));
  EXPECT_EQ(encode_single(Bytes(8, 1), out), 0U);
  Bytes long_out(64, 0);
  EXPECT_EQ(encode_single(Bytes(62, 1), long_out), 64U);
  EXPECT_EQ(long_out[0], 0);
  EXPECT_EQ(long_out[1], 62);
  EXPECT_EQ(encode_first(20, Bytes(20, 0x55), out), 6U);
  EXPECT_THAT(out, ElementsAre(0x10, 0x14, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55));
  EXPECT_EQ(encode_first(65535, Bytes(65535, 0x66), out), 2U);
  EXPECT_THAT(out, ElementsAre(0x10, 0x00, 0x00, 0x00, 0xFF, 0xFF, 0x66, 0x66));
  EXPECT_EQ(encode_consecutive(17, Bytes{1, 2}, out), 3U);
  EXPECT_EQ(out[0], 0x21);
  EXPECT_EQ(encode_flow_control({FlowStatus::overflow, 1, 2}, out), 3U);
  EXPECT_EQ(out[0], 0x32);
}

TEST(IsotpCodec, SeparationTimes) {
  EXPECT_EQ(separation_time(0), Time{0});
  EXPECT_EQ(separation_time(0x7F), std::chrono::milliseconds(127));
  EXPECT_EQ(separation_time(0xF9), std::chrono::microseconds(900));
  for (const std::uint8_t reserved : std::initializer_list<std::uint8_t>{0x80, 0xF0, 0xFA, 0xFF}) {
    EXPECT_EQ(separation_time(reserved), std::chrono::milliseconds(127));
  }
  EXPECT_EQ(st_min_for(Time{0}), 0);
  EXPECT_EQ(st_min_for(std::chrono::microseconds(101)), 0xF2);
  EXPECT_EQ(st_min_for(std::chrono::microseconds(901)), 1);
  EXPECT_EQ(st_min_for(std::chrono::seconds(1)), 127);
}

}  // namespace
}  // namespace selfcal::isotp
