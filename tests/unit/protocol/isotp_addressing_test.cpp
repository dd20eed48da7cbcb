// Extended and mixed addressing (ISO 15765-2, 10.3): an address byte before all else. Literal frames, and any length back to back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/isotp/transport.hpp"
#include "tests/unit/protocol/frames.hpp"

namespace selfcal::isotp {
namespace {

using test::frame;
using test::ms;
using test::take_all;
using testing::ElementsAre;
using testing::IsEmpty;
using Bytes = std::vector<std::uint8_t>;

std::vector<Result> results(const Events& events) { return {events.begin(), events.end()}; }

Bytes counting(std::size_t count) {
  Bytes bytes(count);
  for (std::size_t k = 0; k < count; ++k) {
    bytes[k] = static_cast<std::uint8_t>(k + 1);
  }
  return bytes;
}

Options tester_options() {
  Options options = test::tester_options();
  options.address = {0x6F1, 0x612, 0x6F1, false, 0x12, 0xF1, 0xDF};
  return options;
}

Options ins_options() {
  Options options = test::ins_options();
  options.address = {0x612, 0x6F1, 0x6F1, false, 0xF1, 0x12, 0xDF};
  return options;
}

TEST(IsotpAddressing, SixBytesAreASingleFrameAndSevenAreNot) {
  Transport tester(tester_options());
  ASSERT_TRUE(tester.send(counting(6), ms(0)));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("6F1#1206010203040506"));
  ASSERT_TRUE(tester.send(counting(7), ms(0)));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("6F1#1210070102030405"));
}

TEST(IsotpAddressing, ALongMessageIsAddressedInEachFrame) {
  Transport tester(tester_options()), ins(ins_options());
  ASSERT_TRUE(tester.send(counting(14), ms(0)));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("6F1#12100E0102030405"));
  ins.on_frame(frame("6F1#12100E0102030405"), ms(0));
  EXPECT_THAT(take_all(ins, ms(0)), ElementsAre("612#F1300000CCCCCCCC"));
  tester.on_frame(frame("612#F1300000CCCCCCCC"), ms(0));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("6F1#1221060708090A0B", "6F1#12220C0D0ECCCCCC"));
  ins.on_frame(frame("6F1#1221060708090A0B"), ms(0));
  EXPECT_THAT(results(ins.on_frame(frame("6F1#12220C0D0ECCCCCC"), ms(0))), ElementsAre(Result::received));
  EXPECT_THAT(ins.message(), testing::ElementsAreArray(counting(14)));
}

// Requests to one and to all have one identifier here: the address tells them apart.
TEST(IsotpAddressing, AnotherAddressIsNotMeant) {
  Transport tester(tester_options()), ins(ins_options());
  ASSERT_TRUE(tester.send_functional(Bytes{0x3E, 0x80}, ms(0)));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("6F1#DF023E80CCCCCCCC"));
  EXPECT_THAT(results(ins.on_frame(frame("6F1#DF023E80CCCCCCCC"), ms(0))), ElementsAre(Result::received_functional));
  EXPECT_THAT(results(ins.on_frame(frame("6F1#12023E00CCCCCCCC"), ms(0))), ElementsAre(Result::received));
  EXPECT_THAT(results(ins.on_frame(frame("6F1#13023E00CCCCCCCC"), ms(0))), IsEmpty());
  EXPECT_FALSE(ins.accepts(frame("6F1#13023E00CCCCCCCC")));
  EXPECT_FALSE(ins.accepts(frame("6F1#")));
}

// A first frame of classic CAN is full: one byte less is none.
TEST(IsotpAddressing, AFrameThatIsOneByteShortIsNoFirstFrame) {
  Transport ins(ins_options());
  EXPECT_THAT(results(ins.on_frame(frame("6F1#12100E01020304"), ms(0))), IsEmpty());
  EXPECT_FALSE(ins.receiving());
}

TEST(IsotpAddressing, MixedAddressingHasOneByteBothWays) {
  Options options = test::tester_options();
  options.address = {0x18CE2AF1, 0x18CEF12A, 0x18CD33F1, true, 0x5C, 0x5C, 0x5C};
  Transport tester(options);
  ASSERT_TRUE(tester.send(Bytes{0x10, 0x03}, ms(0)));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("18CE2AF1#5C021003CCCCCCCC"));
  EXPECT_THAT(results(tester.on_frame(frame("18CEF12A#5C06500300320064"), ms(0))), ElementsAre(Result::received));
}

class IsotpAddressed : public testing::TestWithParam<std::size_t> {};

TEST_P(IsotpAddressed, CarriesAnyLength) {
  Options a = tester_options(), b = ins_options();
  a.fd = b.fd = GetParam() > 8;
  a.frame_bytes = b.frame_bytes = GetParam();
  Transport sender(a), receiver(b);
  std::vector<can::CanFrame> out(32);
  for (const std::size_t size : {1U, 5U, 6U, 7U, 8U, 9U, 10U, 11U, 60U, 61U, 62U, 63U, 4095U, 4096U}) {
    ASSERT_TRUE(sender.send(counting(size), ms(0)));
    bool received = false;
    for (int turn = 0; turn < 10'000 && !received; ++turn) {
      const std::size_t count = sender.pending(out, ms(0));
      sender.sent(count, ms(0));
      for (std::size_t k = 0; k < count; ++k) {
        EXPECT_EQ(out[k].data[0], 0x12);
        for (const Result result : receiver.on_frame(out[k], ms(0))) {
          received = received || result == Result::received;
        }
      }
      const std::size_t back = receiver.pending(out, ms(0));
      receiver.sent(back, ms(0));
      for (std::size_t k = 0; k < back; ++k) {
        sender.on_frame(out[k], ms(0));
      }
    }
    ASSERT_TRUE(received) << size;
    EXPECT_THAT(receiver.message(), testing::ElementsAreArray(counting(size)));
  }
}

INSTANTIATE_TEST_SUITE_P(EveryFrameLength, IsotpAddressed, testing::Values(8, 12, 16, 20, 24, 32, 48, 64));

}  // namespace
}  // namespace selfcal::isotp
