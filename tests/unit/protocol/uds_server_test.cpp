#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/uds/decode.hpp"
#include "protocol/uds/messages.hpp"
#include "protocol/uds/server.hpp"
#include "tests/unit/protocol/frames.hpp"

namespace selfcal::uds {
namespace {

using test::frame;
using test::ms;
using test::take_all;
using testing::ElementsAre;
using testing::IsEmpty;

class Handler : public RequestHandler {
 public:
  Answer handle(std::span<const std::uint8_t> request, Bytes& response, Time) override {
    seen.emplace_back(request.begin(), request.end());
    response = answer;
    return mode;
  }
  void session_expired(Time) override { ++expired; }

  std::vector<Bytes> seen;
  Bytes answer;
  Answer mode = Answer::now;
  int expired = 0;
};

class UdsServer : public testing::Test {
 protected:
  Handler handler;
  Server server{test::ins_options(), ServerTimings{}, handler};
};

TEST_F(UdsServer, AnswersAndKeepsSilentWhenAskedTo) {
  handler.answer = {0x50, 3, 0, 50, 1, 0xF4};
  server.on_frame(frame("640#021003"), ms(0));
  EXPECT_THAT(take_all(server, ms(0)), ElementsAre("648#065003003201F4CC"));
  server.on_frame(frame("640#021083"), ms(1));
  EXPECT_THAT(handler.seen.back(), ElementsAre(0x10, 3));  // without the bit
  EXPECT_THAT(take_all(server, ms(1)), IsEmpty());
  handler.answer = {0x7F, 0x10, 0x22};
  server.on_frame(frame("640#021083"), ms(2));  // but a "no" is always told
  EXPECT_THAT(take_all(server, ms(2)), ElementsAre("648#037F1022CCCCCCCC"));
}

TEST_F(UdsServer, FunctionalRequestGetsNoUselessNo) {
  for (const std::uint8_t nrc : std::initializer_list<std::uint8_t>{0x11, 0x12, 0x31, 0x7E, 0x7F}) {
    handler.answer = {0x7F, 0x22, nrc};
    server.on_frame(frame("7DF#0322F190"), ms(0));
    EXPECT_THAT(take_all(server, ms(0)), IsEmpty()) << int{nrc};
  }
  handler.answer = {0x7F, 0x22, 0x22};
  server.on_frame(frame("7DF#0322F190"), ms(0));
  EXPECT_THAT(take_all(server, ms(0)), ElementsAre("648#037F2222CCCCCCCC"));
}

TEST_F(UdsServer, ResponsePendingUntilTheAnswer) {
  handler.mode = RequestHandler::Answer::later;
  server.on_frame(frame("640#0431810302"), ms(0));  // with "no positive response": after 0x78 it comes all the same
  EXPECT_EQ(server.next_deadline(), ms(25));
  server.on_time(ms(25));
  EXPECT_THAT(take_all(server, ms(25)), ElementsAre("648#037F3178CCCCCCCC"));
  server.on_frame(frame("640#023E00"), ms(30));  // one request at a time
  EXPECT_EQ(handler.seen.size(), 1U);
  server.respond(Bytes{0x71, 1, 3, 2}, ms(40));
  EXPECT_THAT(take_all(server, ms(40)), ElementsAre("648#0471010302CCCCCC"));
  EXPECT_TRUE(server.idle());
}

TEST_F(UdsServer, SessionExpiresUnlessKept) {
  server.run_session_timer(true, ms(0));
  server.on_frame(frame("7DF#023E80"), ms(4000));
  EXPECT_THAT(handler.seen, IsEmpty());
  server.on_time(ms(8999));
  EXPECT_EQ(handler.expired, 0);
  server.on_time(ms(9000));
  EXPECT_EQ(handler.expired, 1);
  server.on_time(ms(20'000));
  EXPECT_EQ(handler.expired, 1);
}

// Names that only this test gives.
uds::Names names() {
  uds::Names names;
  names.dids = {{0xF18C, "serial"}, {0x0200, "state"}};
  names.routines = {{0x0301, "turn"}};
  names.texts = {0xF18C};
  names.upload_by_page = true;
  return names;
}

TEST(UdsDecode, MessagesByName) {
  const auto describe_message = [](const Bytes& message) { return uds::describe_message(message, names()); };
  EXPECT_EQ(describe_message(Bytes{0x22, 0xF1, 0x8C}), "ReadDataByIdentifier (0x22) serial (0xF18C)");
  EXPECT_EQ(describe_message(Bytes{0x62, 0x02, 0x00, 1, 2}),
            "positive ReadDataByIdentifier (0x62) state (0x0200): 01 02");
  EXPECT_EQ(describe_message(Bytes{0x7F, 0x35, 0x31}), "negative RequestUpload: requestOutOfRange (0x31)");
  EXPECT_EQ(describe_message(Bytes{0x31, 1, 3, 1, 0, 0, 0, 5}),
            "RoutineControl (0x31) start turn (0x0301): 00 00 00 05");
  EXPECT_EQ(describe_message(Bytes{0x35, 0, 0x44, 0, 0, 0, 7, 0, 0, 0x10, 0}),
            "RequestUpload (0x35) from page 7, 4096 bytes");
  EXPECT_EQ(describe_message(Bytes{0x27, 2, 0xDE, 0xAD}), "SecurityAccess (0x27) key (2 bytes)");  // never the key
  EXPECT_EQ(describe_message(Bytes{0x62, 0xF1, 0x8C, 'S', 'I', 'M', '-', '1'}),
            "positive ReadDataByIdentifier (0x62) serial (0xF18C): \"SIM-1\"");
  EXPECT_EQ(describe_message(Bytes{0x62, 0xF1, 0x8C, 0x1B, '[', '"'}),
            "positive ReadDataByIdentifier (0x62) serial (0xF18C): \"\\x1B[\\x22\"");
  EXPECT_EQ(describe_message(Bytes{0x22, 0xF1, 0x95}), "ReadDataByIdentifier (0x22) unknown (0xF195)");
  EXPECT_EQ(uds::describe_message(Bytes{0x35, 0, 0x32, 1, 0, 0, 2, 0}), "RequestUpload (0x35) from 0x100, 512 bytes");
  EXPECT_EQ(describe_message(Bytes{0x35, 0, 0x44, 0, 0, 0, 7}), "RequestUpload (0x35): 00 44 00 00 00 07");
  EXPECT_EQ(describe_message({}), "empty message");
  EXPECT_EQ(describe_message(Bytes{0x7F, 1}), "malformed negative response: 01");
}

TEST(UdsDecode, LogOfFrames) {
  DecoderOptions options;
  options.request_id = 0x640;
  options.response_id = 0x648;
  options.functional_id = 0x7DF;
  options.names = names();
  options.status = [](const can::CanFrame& frame) {
    return frame.id == 0x650 ? std::vector<LogEntry::Signal>{{"State", 2.0, "rotating"}, {"Alive", 171.0, "171"}}
                             : std::vector<LogEntry::Signal>{};
  };
  LogDecoder decoder(options);
  const auto told = [&decoder](const char* text, Time now) {
    const auto entry = decoder.on_frame(frame(text), now);
    return entry ? line(*entry) : std::string("nothing");
  };
  EXPECT_EQ(told("640#0322F18C", ms(1)), "(0.001000) tester  ReadDataByIdentifier (0x22) serial (0xF18C)");
  EXPECT_EQ(told("648#100862F18C414243", ms(2)), "nothing");
  EXPECT_EQ(told("640#300000", ms(3)), "nothing");
  EXPECT_EQ(told("648#214445CCCCCCCCCC", ms(4)),
            "(0.004000) INS     positive ReadDataByIdentifier (0x62) serial (0xF18C): \"ABCDE\"");
  EXPECT_EQ(told("650#12041303020100AB", ms(5)), "(0.005000) status   State=rotating Alive=171");
  EXPECT_EQ(decoder.malformed(), 0U);
  EXPECT_EQ(told("648#2200", ms(6)), "(0.006000) INS     broken: consecutive frame without a first one");
  EXPECT_EQ(told("123#00", ms(7)), "nothing");
  EXPECT_EQ(decoder.messages(), 2U);
  EXPECT_EQ(decoder.malformed(), 1U);
}

}  // namespace
}  // namespace selfcal::uds
