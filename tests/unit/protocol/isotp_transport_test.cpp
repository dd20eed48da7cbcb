// The state machine, frame by frame, in literal bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/isotp/transport.hpp"
#include "tests/unit/protocol/frames.hpp"

namespace selfcal::isotp {
namespace {

using test::frame;
using test::ms;
using test::ramp;
using test::take_all;
using testing::ElementsAre;
using testing::IsEmpty;
using Bytes = std::vector<std::uint8_t>;

std::vector<Result> results(const Events& events) { return {events.begin(), events.end()}; }

TEST(IsotpSender, SingleFrameIsPaddedOrNot) {
  Transport padded(test::tester_options());
  ASSERT_TRUE(padded.send(Bytes{0x10, 0x03}, ms(0)));
  EXPECT_FALSE(padded.send(Bytes{0x10, 0x03}, ms(0)));  // one at a time
  EXPECT_THAT(take_all(padded, ms(0)), ElementsAre("640#021003CCCCCCCCCC"));
  EXPECT_FALSE(padded.sending());

  Options bare = test::tester_options();
  bare.padding = false;
  Transport unpadded(bare);
  ASSERT_TRUE(unpadded.send(Bytes{0x10, 0x03}, ms(0)));
  EXPECT_THAT(take_all(unpadded, ms(0)), ElementsAre("640#021003"));
}

TEST(IsotpSender, BlocksSeparationAndWait) {
  Transport sender(test::tester_options());
  ASSERT_TRUE(sender.send(ramp(30), ms(0)));
  EXPECT_THAT(take_all(sender, ms(0)), ElementsAre("640#101E00070E151C23"));
  EXPECT_TRUE(sender.on_frame(frame("648#31000000"), ms(900)).empty());  // WAIT starts N_Bs anew
  EXPECT_TRUE(sender.on_time(ms(1800)).empty());
  EXPECT_TRUE(sender.on_frame(frame("648#30020A"), ms(1800)).empty());  // two frames, 10 ms apart
  EXPECT_THAT(take_all(sender, ms(1800)), ElementsAre("640#212A31383F464D54"));
  EXPECT_EQ(sender.next_deadline(), ms(1810));
  EXPECT_THAT(take_all(sender, ms(1809)), IsEmpty());
  EXPECT_THAT(take_all(sender, ms(1810)), ElementsAre("640#225B626970777E85"));
  EXPECT_THAT(take_all(sender, ms(1900)), IsEmpty());  // the block is over
  sender.on_frame(frame("648#300000"), ms(1900));
  EXPECT_THAT(take_all(sender, ms(1900)), ElementsAre("640#238C939AA1A8AFB6", "640#24BDC4CBCCCCCCCC"));
  EXPECT_FALSE(sender.sending());
}

TEST(IsotpSender, GivesUpAndSaysWhy) {
  const auto begun = [] {
    Transport sender(test::tester_options());
    EXPECT_TRUE(sender.send(ramp(30), ms(0)));
    take_all(sender, ms(0));
    return sender;
  };
  Transport overflow = begun();
  EXPECT_THAT(results(overflow.on_frame(frame("648#320000"), ms(1))), ElementsAre(Result::overflow));
  Transport invalid = begun();
  EXPECT_THAT(results(invalid.on_frame(frame("648#350000"), ms(1))), ElementsAre(Result::invalid_flow_status));
  Transport silent = begun();
  EXPECT_TRUE(silent.on_time(ms(999)).empty());
  EXPECT_THAT(results(silent.on_time(ms(1000))), ElementsAre(Result::timeout_bs));
  Transport waits = begun();
  for (int i = 0; i < 16; ++i) {
    EXPECT_TRUE(waits.on_frame(frame("648#310000"), ms(i)).empty());
  }
  EXPECT_THAT(results(waits.on_frame(frame("648#310000"), ms(20))), ElementsAre(Result::too_many_waits));
  Transport stuck(test::tester_options());
  ASSERT_TRUE(stuck.send(Bytes{1}, ms(0)));
  EXPECT_THAT(results(stuck.on_time(ms(1000))), ElementsAre(Result::timeout_a));
  for (const Transport* t : {&overflow, &invalid, &silent, &waits, &stuck}) {
    EXPECT_FALSE(t->sending());
    EXPECT_EQ(t->next_deadline(), std::nullopt);
  }
}

TEST(IsotpReceiver, SegmentedMessageInBlocks) {
  Options options = test::ins_options();
  options.block_size = 2;
  options.st_min = 0xF5;
  Transport receiver(options);
  EXPECT_THAT(results(receiver.on_frame(frame("640#101E00070E151C23"), ms(0))), ElementsAre(Result::reception_started));
  EXPECT_THAT(take_all(receiver, ms(0)), ElementsAre("648#3002F5CCCCCCCCCC"));
  EXPECT_TRUE(receiver.on_frame(frame("640#212A31383F464D54"), ms(1)).empty());
  EXPECT_THAT(take_all(receiver, ms(1)), IsEmpty());
  EXPECT_TRUE(receiver.on_frame(frame("640#225B626970777E85"), ms(2)).empty());
  EXPECT_THAT(take_all(receiver, ms(2)), ElementsAre("648#3002F5CCCCCCCCCC"));
  EXPECT_TRUE(receiver.on_frame(frame("640#238C939AA1A8AFB6"), ms(3)).empty());
  EXPECT_THAT(results(receiver.on_frame(frame("640#24BDC4CB"), ms(4))), ElementsAre(Result::received));
  EXPECT_TRUE(std::ranges::equal(receiver.message(), ramp(30)));
}

TEST(IsotpReceiver, LossIsReported) {
  Transport receiver(test::ins_options());
  const auto start = [&](Time now) {
    receiver.on_frame(frame("640#101E00070E151C23"), now);
    take_all(receiver, now);
  };
  start(ms(0));
  EXPECT_THAT(results(receiver.on_frame(frame("640#225B626970777E85"), ms(1))), ElementsAre(Result::wrong_sequence));
  EXPECT_TRUE(receiver.on_frame(frame("640#238C939AA1A8AFB6"), ms(1)).empty());  // the rest goes by
  start(ms(10));
  EXPECT_THAT(results(receiver.on_time(ms(1010))), ElementsAre(Result::timeout_cr));
  start(ms(2000));
  EXPECT_THAT(results(receiver.on_frame(frame("640#0110"), ms(2001))),
              ElementsAre(Result::unexpected_frame, Result::received));
  EXPECT_THAT(receiver.message(), ElementsAre(0x10));
}

TEST(IsotpReceiver, ShortConsecutiveFrameDoesNotCount) {
  Transport receiver(test::ins_options());
  receiver.on_frame(frame("640#101E00070E151C23"), ms(0));
  take_all(receiver, ms(0));
  EXPECT_TRUE(receiver.on_frame(frame("640#212A31"), ms(1)).empty());
  EXPECT_THAT(results(receiver.on_frame(frame("640#225B626970777E85"), ms(2))), ElementsAre(Result::wrong_sequence));
}

TEST(IsotpReceiver, TooLongAMessageMeetsOverflow) {
  Options options = test::ins_options();
  options.max_message = 4095;
  Transport receiver(options);
  EXPECT_THAT(results(receiver.on_frame(frame("640#100000001000AABB"), ms(0))), ElementsAre(Result::message_too_long));
  EXPECT_THAT(take_all(receiver, ms(0)), ElementsAre("648#320000CCCCCCCCCC"));
  EXPECT_FALSE(receiver.receiving());
}

TEST(IsotpReceiver, HeldReceptionWaitsThenGoesOn) {
  Transport receiver(test::ins_options());
  receiver.hold_reception(true, ms(0));
  receiver.on_frame(frame("640#101E00070E151C23"), ms(0));
  EXPECT_THAT(take_all(receiver, ms(0)), ElementsAre("648#310000CCCCCCCCCC"));
  EXPECT_EQ(receiver.next_deadline(), ms(500));
  receiver.on_time(ms(500));
  EXPECT_THAT(take_all(receiver, ms(500)), ElementsAre("648#310000CCCCCCCCCC"));
  receiver.hold_reception(false, ms(600));
  EXPECT_THAT(take_all(receiver, ms(600)), ElementsAre("648#300000CCCCCCCCCC"));
}

TEST(IsotpTransport, FunctionalSingleFrameBesideATransfer) {
  Transport tester(test::tester_options());
  Transport ins(test::ins_options());
  ASSERT_TRUE(tester.send(ramp(30), ms(0)));
  ASSERT_TRUE(tester.send_functional(Bytes{0x3E, 0x80}, ms(0)));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("7DF#023E80CCCCCCCCCC", "640#101E00070E151C23"));
  EXPECT_THAT(results(ins.on_frame(frame("7DF#023E80CCCCCCCCCC"), ms(0))), ElementsAre(Result::received_functional));
  EXPECT_THAT(ins.message(), ElementsAre(0x3E, 0x80));
  EXPECT_TRUE(ins.on_frame(frame("7DF#101E00070E151C23"), ms(0)).empty());  // single frames only
  EXPECT_FALSE(ins.receiving());
}

TEST(IsotpTransport, TwentyNineBitIdentifiersAreNotElevenBitOnes) {
  Options options = test::tester_options();
  options.address = {0x18DA10F1, 0x18DAF110, std::nullopt, true};
  Transport tester(options);
  ASSERT_TRUE(tester.send(Bytes{0x10, 0x03}, ms(0)));
  EXPECT_THAT(take_all(tester, ms(0)), ElementsAre("18DA10F1#021003CCCCCCCCCC"));
  EXPECT_TRUE(tester.accepts(frame("18DAF110#0250")));
  EXPECT_FALSE(tester.accepts(frame("648#0250")));
}

class IsotpFd : public testing::TestWithParam<std::size_t> {};

// Every FD frame length, short and long message, through two transports back to back.
TEST_P(IsotpFd, CarriesAnyLength) {
  Options a = test::tester_options();
  Options b = test::ins_options();
  a.fd = b.fd = true;
  a.frame_bytes = b.frame_bytes = GetParam();
  Transport sender(a);
  Transport receiver(b);
  std::vector<can::CanFrame> out(32);
  for (const std::size_t size : {1U, 7U, 8U, 10U, 62U, 63U, 100U, 4095U, 4096U, 65535U}) {
    ASSERT_TRUE(sender.send(ramp(size), ms(0)));
    bool received = false;
    for (int turn = 0; turn < 70'000 && !received; ++turn) {
      std::size_t count = sender.pending(out, ms(0));
      sender.sent(count, ms(0));
      for (std::size_t i = 0; i < count; ++i) {
        EXPECT_LE(out[i].size, GetParam());
        for (const Result r : receiver.on_frame(out[i], ms(0))) {
          received = received || r == Result::received;
        }
      }
      count = receiver.pending(out, ms(0));
      receiver.sent(count, ms(0));
      for (std::size_t i = 0; i < count; ++i) {
        sender.on_frame(out[i], ms(0));
      }
    }
    ASSERT_TRUE(received) << size;
    EXPECT_TRUE(std::ranges::equal(receiver.message(), ramp(size))) << size;
    EXPECT_FALSE(sender.sending());
  }
}
INSTANTIATE_TEST_SUITE_P(FrameLengths, IsotpFd, testing::Values(8, 12, 16, 20, 24, 32, 48, 64));

}  // namespace
}  // namespace selfcal::isotp
