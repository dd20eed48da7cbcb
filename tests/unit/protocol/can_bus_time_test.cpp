// Frame lengths. The literals come from a second program that builds each frame as a string of 0 and 1, divides it by
// the CRC polynomial, and stuffs it; the first is counted by hand.
#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "protocol/can/bus_load.hpp"
#include "protocol/can/bus_time.hpp"

namespace selfcal::can {
namespace {

CanFrame frame(std::uint32_t id, const std::vector<std::uint8_t>& data, bool fd = false, bool extended = false) {
  CanFrame result;
  result.id = id;
  result.extended = extended;
  result.fd = fd;
  result.bit_rate_switch = fd;
  result.size = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), result.data.begin());
  return result;
}

void expect_bits(const CanFrame& f, std::uint32_t nominal, std::uint32_t data, std::uint32_t stuff) {
  const FrameBits bits = frame_bits(f);
  EXPECT_EQ(bits.nominal, nominal);
  EXPECT_EQ(bits.data, data);
  EXPECT_EQ(bits.stuff, stuff);
}

// 19 zeros of header, CRC of zeros is zero: 34 zeros, a stuff bit after each five of them (6), and 13 bits of tail.
TEST(BusTime, AllDominantClassicFrame) { expect_bits(frame(0, {}), 53, 0, 6); }

TEST(BusTime, ClassicFrames) {
  expect_bits(frame(0x648, {0x21, 1, 2, 3, 4, 5, 6, 7}), 120, 0, 9);
  expect_bits(frame(0x7FF, std::vector<std::uint8_t>(8, 0xFF)), 126, 0, 15);
  expect_bits(frame(0x18DA10F1, {2, 0x10, 3, 0xCC, 0xCC, 0xCC, 0xCC, 0xCC}, false, true), 135, 0, 4);
  CanFrame remote = frame(0x123, {});
  remote.remote = true;
  remote.size = 4;
  expect_bits(remote, 47, 0, 0);
}

TEST(BusTime, FdFrames) {
  std::vector<std::uint8_t> ramp(64);
  std::iota(ramp.begin(), ramp.end(), std::uint8_t{0});
  expect_bits(frame(0x640, {2, 0x10, 3, 0xCC, 0xCC, 0xCC, 0xCC, 0xCC}, true), 30, 101, 11);
  expect_bits(frame(0x648, ramp, true), 30, 575, 33);
  // 64 zero bytes end in a run of five: the fixed stuff bit stands in for the dynamic one.
  expect_bits(frame(0, std::vector<std::uint8_t>(64, 0), true), 31, 652, 111);
  CanFrame slow = frame(0x18DA10F1, std::vector<std::uint8_t>(12, 0xFF), true, true);
  slow.bit_rate_switch = false;
  expect_bits(slow, 48 + 148, 0, 25);
}

TEST(BusTime, TwoRatesAddUp) {
  const CanFrame f = frame(0x640, {2, 0x10, 3, 0xCC, 0xCC, 0xCC, 0xCC, 0xCC}, true);
  EXPECT_EQ(frame_time(f, {1'000'000, 5'000'000}), Time(30'000 + 101 * 200));
  EXPECT_EQ(frame_time(f, {500'000, 2'000'000}), Time(60'000 + 101 * 500));
}

TEST(BusClock, FramesQueueBehindEachOther) {
  BusClock clock({1'000'000, 5'000'000});
  const CanFrame f = frame(0, {});  // 53 us
  EXPECT_EQ(clock.transmit(f, Time{0}), Time(53'000));
  EXPECT_EQ(clock.transmit(f, Time{10'000}), Time(106'000));
  EXPECT_EQ(clock.transmit(f, Time{200'000}), Time(253'000));
  EXPECT_EQ(clock.busy(), Time(159'000));
  EXPECT_EQ(clock.frames(), 3U);
}

TEST(FrameSize, LengthCodes) {
  EXPECT_EQ(frame_size_for(8), 8U);
  EXPECT_EQ(frame_size_for(9), 12U);
  EXPECT_EQ(frame_size_for(33), 48U);
  EXPECT_EQ(frame_size_for(64), 64U);
  for (std::uint8_t dlc = 0; dlc < 16; ++dlc) {
    EXPECT_EQ(dlc_of_size(size_of_dlc(dlc)), dlc);
  }
}

}  // namespace
}  // namespace selfcal::can
