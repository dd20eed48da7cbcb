// What a listener on the bus sees of the virtual INS while its FLASH works: response-pending and the answer, each in its
// time, whoever else speaks meanwhile; and what becomes of the session. Literal bytes, a clock in steps of a millisecond.
#include <gmock/gmock.h>

#include <algorithm>

#include "protocol/byte_order.hpp"
#include "sim_ins/device/turnaround.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/unit/protocol/frames.hpp"
#include "tests/unit/sim_ins/virtual_unit.hpp"

namespace selfcal::sim {
namespace {

using namespace std::chrono_literals;
using test::frame;
using testing::ElementsAre;
using testing::IsEmpty;

// ISO 14229-2, table 4: what the server has from the request to its answer, or to response-pending; from there to the
// next of the two; and how long a session outlives the last request.
constexpr Time p2 = 50ms, p2_star = 5s, s3 = 5s;

constexpr const char* erase = "640#0431010302";  // RoutineControl, start, eraseInactiveSlot
constexpr const char* erased = "648#0471010302CCCCCC";
constexpr const char* pending = "648#037F3178CCCCCCCC";
constexpr const char* keep_alive = "7DF#023E80";  // TesterPresent, no answer wanted, to all
constexpr const char* not_in_this_session = "648#037F317FCCCCCCCC";

struct Seen {
  Time at;
  std::string frame;
};

class ResponsePending : public testing::Test {
 protected:
  ResponsePending() : unit_(config(), *FlashMemory::open("", flash_bytes), options()) {
    unit_.power_on(now_);
    pass(2s);
    open_lock();
  }

  static SimConfig config() {
    SimConfig config;
    config.sample_rate_hz = 50.0;
    return config;
  }
  static constexpr uds::SecurityKey key{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  static DiagnosticOptions options() {
    DiagnosticOptions options;
    options.key = key;
    options.seed_salt = 99;
    return options;
  }

  // One millisecond, in which the INS works and a listener writes down what it sends.
  void tick() {
    unit_.step(now_);
    for (std::string& text : test::take_all(unit_, now_)) {
      seen_.push_back({now_, std::move(text)});
    }
    now_ += 1ms;
  }
  void pass(Time time) {
    for (const Time end = now_ + time; now_ < end;) {
      tick();
    }
  }
  void tell(std::string_view text) {
    unit_.step(now_);  // its clock is the bus's
    unit_.on_frame(frame(text), now_);
  }
  // All that is seen within `time` after a request.
  std::vector<Seen> ask(std::string_view request, Time time) {
    seen_.clear();
    tell(request);
    pass(time);
    return seen_;
  }
  static std::vector<std::string> frames(const std::vector<Seen>& seen) {
    std::vector<std::string> result;
    result.reserve(seen.size());
    for (const Seen& one : seen) {
      result.push_back(one.frame);
    }
    return result;
  }

  struct Segmented {
    Time asked{0};              // the request's last frame
    std::vector<Seen> answers;  // frames of the INS, flow control left out
    uds::Bytes message;         // the answer, put together
  };
  // A request of several frames, one a millisecond, and its answer; `between` is on the bus after each frame.
  Segmented ask_in_frames(const uds::Bytes& request, const char* between = nullptr) {
    isotp::Transport tester(test::tester_options());
    Segmented result;
    EXPECT_TRUE(tester.send(request, now_));
    for (const Time end = now_ + 500ms; now_ < end; now_ += 1ms) {
      unit_.step(now_);
      if (can::CanFrame out; tester.pending({&out, 1}, now_) == 1) {
        result.asked = tester.sending() ? now_ : result.asked;  // not the flow control for the answer
        unit_.on_frame(out, now_);
        tester.sent(1, now_);
      }
      if (between != nullptr) {
        tell(between);
      }
      unit_.step(now_);
      for (can::CanFrame in; unit_.pending({&in, 1}, now_) == 1;) {
        unit_.sent(1, now_);
        if (in.data[0] >> 4 != 3) {
          result.answers.push_back({now_, test::text(in)});
        }
        for (const isotp::Result event : tester.on_frame(in, now_)) {
          if (event == isotp::Result::received) {
            result.message.assign(tester.message().begin(), tester.message().end());
          }
        }
        if (between != nullptr) {
          break;
        }
      }
    }
    return result;
  }

  uds::Bytes answer_to(const uds::Bytes& request) {
    uds::Bytes response;
    unit_.diagnostics().handle(request, response, now_);
    return response;
  }
  void open_lock() {
    tell("640#021003");
    pass(10ms);
    const uds::Bytes response = answer_to(uds::seed_request());
    const auto seed = uds::read_seed_response(response);
    ASSERT_TRUE(seed);
    answer_to(uds::key_request(*uds::answer_seed(key, *seed)));
    pass(100ms);  // the attempt is counted, then judged
    ASSERT_TRUE(unit_.diagnostics().unlocked());
    tell(keep_alive);  // S3 begins here
    tick();
    seen_.clear();
  }

  Time now_{0};
  VirtualUnit unit_;
  std::vector<Seen> seen_;
};

// 45 ms for the block: too near to P2 for an INS to bet on it.
TEST_F(ResponsePending, ErasureIsAnnouncedWithinP2AndAnsweredWhenDone) {
  const Time asked = now_;
  const auto seen = ask(erase, 1s);
  ASSERT_THAT(frames(seen), ElementsAre(pending, erased));
  EXPECT_LE(seen[0].at - asked, p2);
  EXPECT_GE(seen[1].at - asked, 45ms);
  EXPECT_LE(seen[1].at - asked, 46ms);  // the first step of the clock after it
}

// The same chip's guaranteed limits: 400 ms for a block, 3 ms for 256 bytes, of which a set takes two and its mark one.
TEST_F(ResponsePending, TheSlowestChipThatIsSoldKeepsTheTimesToo) {
  unit_.flash().set_timings({3e-3, 400e-3});
  const Time asked = now_;
  const auto erasure = ask(erase, 1s);
  ASSERT_THAT(frames(erasure), ElementsAre(pending, erased));
  EXPECT_LE(erasure[0].at - asked, p2);
  EXPECT_GE(erasure[1].at - asked, 400ms);
  EXPECT_LE(erasure[1].at - erasure[0].at, p2_star);

  ins::Coefficients set;
  set.version = 1;
  set.author = "test";
  const auto record = ins::encode(set);
  const Segmented written = ask_in_frames(uds::write_request(ins::did::coefficients_inactive, record));
  EXPECT_THAT(frames(written.answers), ElementsAre("648#036E0211CCCCCCCC"));
  EXPECT_GE(written.answers[0].at - written.asked, 6ms);
  EXPECT_LE(written.answers[0].at - written.asked, p2);
  uds::Bytes crc(4);
  ByteWriter(crc).put(ins::stored_crc(record));
  const Segmented committed =
      ask_in_frames(uds::routine_request(uds::RoutineAction::start, ins::routine::commit_coefficients, crc));
  EXPECT_THAT(frames(committed.answers), ElementsAre("648#0471010303CCCCCC"));
  EXPECT_GE(committed.answers[0].at - committed.asked, 3ms);
  EXPECT_LE(committed.answers[0].at - committed.asked, p2);
}

// An attempt is counted in FLASH and judged by a second write: response-pending, then the answer, at the same times
// whether the key is right or wrong. A listener with a clock learns nothing before the answer.
TEST_F(ResponsePending, ARightKeyIsAnsweredWhenAWrongOneIs) {
  const auto attempt = [&](bool right) {
    tell("640#021001");  // default session: locked
    pass(10ms);
    tell("640#021003");
    pass(10ms);
    const uds::Bytes seed = answer_to(uds::seed_request());
    const auto expected = uds::answer_seed(key, std::span(seed).subspan(2));
    return ask_in_frames(uds::key_request(right ? uds::Bytes(expected->begin(), expected->end()) : uds::Bytes(16, 0)));
  };
  const Segmented wrong = attempt(false);
  const Segmented right = attempt(true);
  ASSERT_THAT(frames(wrong.answers), ElementsAre("648#037F2778CCCCCCCC", "648#037F2735CCCCCCCC"));  // invalidKey
  ASSERT_THAT(frames(right.answers), ElementsAre("648#037F2778CCCCCCCC", "648#026702CCCCCCCCCC"));
  EXPECT_LE(wrong.answers[0].at - wrong.asked, p2);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(wrong.answers[i].at - wrong.asked, right.answers[i].at - right.asked) << i;
  }
  EXPECT_GE(wrong.answers[1].at - wrong.asked, 2 * 45ms);
}

// A chip at the end of its life: 12 s are three times P2*.
TEST_F(ResponsePending, IsRepeatedWithinEachP2Star) {
  unit_.flash().set_timings({0.8e-3, 12.0});
  Time before = now_;
  auto seen = ask(erase, 13s);
  ASSERT_GE(seen.size(), 4U);
  EXPECT_EQ(seen.back().frame, erased);
  EXPECT_GE(seen.back().at - before, 12s);
  for (Time limit = p2; const Seen& one : seen) {
    EXPECT_LE(one.at - before, limit);
    EXPECT_EQ(one.frame, &one == &seen.back() ? erased : pending);
    before = one.at;
    limit = p2_star;
  }
}

// ISO 14229-1, 7.5.6: a functional TesterPresent that wants no answer passes by whatever the server is at.
TEST_F(ResponsePending, IsNotDisturbedByTheKeepAliveOfASecondTester) {
  const Time asked = now_;
  seen_.clear();
  tell(erase);
  for (int k = 0; k < 500; ++k) {
    tick();
    tell(keep_alive);
  }
  ASSERT_THAT(frames(seen_), ElementsAre(pending, erased));
  EXPECT_LE(seen_[0].at - asked, p2);
  EXPECT_GE(seen_[1].at - asked, 45ms);
  EXPECT_LE(seen_[1].at - asked, 46ms);
  tell(keep_alive);  // nor does it block what comes right behind it
  EXPECT_THAT(frames(ask("640#023E00", 10ms)), ElementsAre("648#027E00CCCCCCCCCC"));
}

// Anything else that comes meanwhile is neither obeyed nor answered, also when it comes to all: one request at a time.
TEST_F(ResponsePending, ASecondRequestMeanwhileIsNotObeyed) {
  seen_.clear();
  tell(erase);
  pass(10ms);
  for (const char* request : {"7DF#023E00", "640#0322F18C", "640#021101", "640#021001"}) {
    tell(request);
    pass(10ms);
  }
  pass(500ms);
  EXPECT_THAT(frames(seen_), ElementsAre(pending, erased));
  EXPECT_TRUE(unit_.diagnostics().unlocked());  // no reset, no other session
}

TEST_F(ResponsePending, KeepAliveBetweenTheFramesOfRequestAndAnswer) {
  unit_.flash().set_timings({0.0, 0.0});
  ASSERT_THAT(frames(ask(erase, 10ms)), ElementsAre(erased));
  ins::Coefficients set;
  set.version = 7;
  set.author = "test";
  // 263 bytes are a first frame of six and 37 frames of seven; a keep-alive after each, also of the answer's.
  const Segmented written =
      ask_in_frames(uds::write_request(ins::did::coefficients_inactive, ins::encode(set)), keep_alive);
  EXPECT_THAT(frames(written.answers), ElementsAre("648#036E0211CCCCCCCC"));
  EXPECT_EQ(unit_.instrument().coefficients().inactive(), set);
  const Segmented read = ask_in_frames(uds::read_request(ins::did::coefficients_inactive), keep_alive);
  ASSERT_EQ(read.answers.size(), 1U + 37U);
  EXPECT_THAT(read.message, testing::SizeIs(3 + ins::coefficients_bytes));
  EXPECT_TRUE(std::ranges::equal(std::span(read.message).subspan(3), ins::encode(set)));
}

TEST_F(ResponsePending, ASessionEndsS3AfterTheLastRequest) {
  ASSERT_THAT(frames(ask("640#023E00", 1ms)), ElementsAre("648#027E00CCCCCCCCCC"));
  pass(s3 - 2ms);
  EXPECT_TRUE(unit_.diagnostics().unlocked());
  pass(3ms);
  EXPECT_FALSE(unit_.diagnostics().unlocked());
  EXPECT_THAT(frames(ask(erase, 100ms)), ElementsAre(not_in_this_session));
}

TEST_F(ResponsePending, ASessionLastsWhileASecondTesterKeepsIt) {
  for (int k = 0; k < 12; ++k) {
    seen_.clear();
    pass(s3 - 100ms);
    tell(keep_alive);
    EXPECT_THAT(seen_, IsEmpty()) << k;
  }
  EXPECT_THAT(frames(ask(erase, 100ms)), ElementsAre(pending, erased));
}

// ISO 14229-2: no S3 while a request is in hand, and all of it from the answer on.
TEST_F(ResponsePending, ASessionOutlivesALongWrite) {
  unit_.flash().set_timings({0.8e-3, 12.0});
  const auto seen = ask(erase, 13s);
  ASSERT_EQ(seen.back().frame, erased);
  EXPECT_TRUE(unit_.diagnostics().unlocked());
  pass(seen.back().at + s3 - 1ms - now_);
  EXPECT_TRUE(unit_.diagnostics().unlocked());
  pass(3ms);
  EXPECT_FALSE(unit_.diagnostics().unlocked());
}

// From the end of an answer, at 10 s, to the next request, once; the driver's flow control costs nothing.
TEST(TurnaroundOfTheTester, IsChargedOnceForEachAnswer) {
  const can::CanFrame request = frame("640#023601");
  Turnaround turnaround(2.0);
  EXPECT_EQ(turnaround.heard(request, 5.0, 4.0), 5.0);  // nothing was answered
  turnaround.answer_sent();
  EXPECT_EQ(turnaround.heard(frame("640#300000"), 5.1, 5.1), 5.1);
  turnaround.answer_sent();
  EXPECT_DOUBLE_EQ(turnaround.heard(request, 9.9995, 10.0), 10.002);
  EXPECT_EQ(turnaround.heard(request, 10.5, 10.4), 10.5);  // asked again before any answer
  turnaround.answer_sent();
  EXPECT_EQ(turnaround.heard(request, 12.0, 11.0), 12.0);  // the clock went on by itself meanwhile
}

}  // namespace
}  // namespace selfcal::sim
