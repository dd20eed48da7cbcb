// A message over a bus that drops, doubles and delays frames: delivered intact or reported by the one who knows, never
// wrong, never a hang. The bus is simulated in virtual time; a failing case prints its seed.
//
// ISO-TP counts modulo 16: frames that are late by a whole round could stand for others. The delays here stay below
// that (a real bus keeps the order of one sender); loss and doubling are unlimited.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "protocol/isotp/transport.hpp"
#include "tests/unit/protocol/frames.hpp"

namespace selfcal::isotp {
namespace {

using test::ms;

enum class Fate : std::uint8_t { deliver, drop, twice, late };

struct Delivery {
  bool to_receiver;
  can::CanFrame frame;
};

class Bus {
 public:
  explicit Bus(std::vector<Fate> fates) : fates_(std::move(fates)) {}

  void carry(const can::CanFrame& frame, bool to_receiver, Time now) {
    const Fate fate = next_ < fates_.size() ? fates_[next_++] : Fate::deliver;
    const Time arrival = now + std::chrono::microseconds(100);
    if (fate == Fate::drop) {
      return;
    }
    queue_.emplace(fate == Fate::late ? arrival + std::chrono::microseconds(350) : arrival,
                   Delivery{to_receiver, frame});
    if (fate == Fate::twice) {
      queue_.emplace(arrival, Delivery{to_receiver, frame});
    }
  }
  std::multimap<Time, Delivery>& queue() { return queue_; }

 private:
  std::vector<Fate> fates_;
  std::size_t next_ = 0;
  std::multimap<Time, Delivery> queue_;
};

struct Outcome {
  std::vector<std::vector<std::uint8_t>> received;
  bool sender_reported = false;  // success or failure
  bool sender_succeeded = false;
  bool receiver_failed = false;
  bool hung = false;
};

Outcome run(Transport& sender, Transport& receiver, Bus& bus, std::span<const std::uint8_t> message) {
  Outcome outcome;
  Time now{0};
  const auto note_sender = [&](const Events& events) {
    for (const Result r : events) {
      outcome.sender_reported = outcome.sender_reported || concerns_sending(r);
      outcome.sender_succeeded = outcome.sender_succeeded || r == Result::sent;
    }
  };
  const auto note_receiver = [&](const Events& events) {
    for (const Result r : events) {
      outcome.receiver_failed = outcome.receiver_failed || is_failure(r);
      if (r == Result::received) {
        outcome.received.emplace_back(receiver.message().begin(), receiver.message().end());
      }
    }
  };
  RC_ASSERT(sender.send(message, now));
  std::array<can::CanFrame, 1> out;  // frame by frame: as a bus is
  for (int step = 0; step < 20'000; ++step) {
    bool progress = false;
    if (sender.pending(out, now) == 1) {
      bus.carry(out[0], true, now);
      note_sender(sender.sent(1, now));
      progress = true;
    }
    if (receiver.pending(out, now) == 1) {
      bus.carry(out[0], false, now);
      note_receiver(receiver.sent(1, now));
      progress = true;
    }
    if (progress) {
      now += std::chrono::microseconds(100);
    } else {
      Time next = bus.queue().empty() ? Time::max() : bus.queue().begin()->first;
      for (const auto& deadline : {sender.next_deadline(), receiver.next_deadline()}) {
        next = std::min(next, deadline.value_or(Time::max()));
      }
      if (next == Time::max()) {
        return outcome;  // at rest
      }
      now = std::max(now, next);
    }
    while (!bus.queue().empty() && bus.queue().begin()->first <= now) {
      const Delivery delivery = bus.queue().begin()->second;
      bus.queue().erase(bus.queue().begin());
      delivery.to_receiver ? note_receiver(receiver.on_frame(delivery.frame, now))
                           : note_sender(sender.on_frame(delivery.frame, now));
    }
    note_sender(sender.on_time(now));
    note_receiver(receiver.on_time(now));
  }
  outcome.hung = true;
  return outcome;
}

RC_GTEST_PROP(IsotpOverABadBus, IntactOrReportedNeverWrongNeverHangs, ()) {
  Options a = test::tester_options();
  Options b = test::ins_options();
  a.fd = b.fd = *rc::gen::arbitrary<bool>();
  a.frame_bytes = a.fd ? *rc::gen::element<std::size_t>(8, 12, 64) : 8;
  b.block_size = *rc::gen::element<std::uint8_t>(0, 1, 3, 8);
  b.st_min = *rc::gen::element<std::uint8_t>(0, 0xF3, 2);
  const auto size = *rc::gen::inRange<std::size_t>(1, 600);
  const auto fates = *rc::gen::container<std::vector<Fate>>(
      rc::gen::weightedElement<Fate>({{20, Fate::deliver}, {1, Fate::drop}, {1, Fate::twice}, {1, Fate::late}}));
  const auto message = test::ramp(size);

  Transport sender(a);
  Transport receiver(b);
  Bus bus(fates);
  const Outcome outcome = run(sender, receiver, bus, message);

  RC_ASSERT(!outcome.hung);
  RC_ASSERT(outcome.sender_reported);
  for (const auto& received : outcome.received) {
    RC_ASSERT(received == message);
  }
  // All frames were out and yet nothing came: then the receiver has said so, unless it never saw the beginning, which
  // for a single frame nobody can know (the answer's P2 finds out).
  const bool segmented = size > max_single_payload(a.frame_bytes);
  if (outcome.sender_succeeded && outcome.received.empty() && segmented) {
    RC_ASSERT(outcome.receiver_failed);
  }
  RC_CLASSIFY(!outcome.received.empty(), "delivered");
  RC_CLASSIFY(outcome.received.empty(), "reported");
}

// The negative control: the same harness sees a delivered message on a good bus.
TEST(IsotpOverAGoodBus, IsDelivered) {
  Transport sender(test::tester_options());
  Transport receiver(test::ins_options());
  Bus bus({});
  const Outcome outcome = run(sender, receiver, bus, test::ramp(599));
  EXPECT_TRUE(outcome.sender_succeeded);
  ASSERT_EQ(outcome.received.size(), 1U);
  EXPECT_EQ(outcome.received[0], test::ramp(599));
}

}  // namespace
}  // namespace selfcal::isotp
