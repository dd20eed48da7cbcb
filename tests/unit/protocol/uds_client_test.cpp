#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/uds/client.hpp"
#include "protocol/uds/messages.hpp"
#include "protocol/uds/security.hpp"
#include "tests/unit/protocol/frames.hpp"

namespace selfcal::uds {
namespace {

using test::frame;
using test::ms;
using test::take_all;
using testing::ElementsAre;
using testing::HasSubstr;

class UdsClient : public testing::Test {
 protected:
  void ask(const Bytes& request, Time now) {
    ASSERT_TRUE(client.request(request, now));
    take_all(client, now);
  }
  Client client{test::tester_options(), ClientTimings{}};
};

TEST_F(UdsClient, PositiveResponse) {
  ask(read_request(0xF18C), ms(0));
  EXPECT_FALSE(client.request(read_request(0xF18C), ms(0)));
  const auto outcome = client.on_frame(frame("648#0562F18C4142"), ms(10));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::positive);
  const auto record = read_read_response(outcome->response, 0xF18C);
  ASSERT_TRUE(record);
  EXPECT_THAT(*record, ElementsAre('A', 'B'));
  EXPECT_FALSE(client.busy());
}

TEST_F(UdsClient, NegativeResponseHasItsName) {
  ask(upload_request(0, 4096), ms(0));
  take_all(client, ms(0));
  client.on_frame(frame("648#300000"), ms(1));
  take_all(client, ms(1));
  const auto outcome = client.on_frame(frame("648#037F3522"), ms(10));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::negative);
  EXPECT_EQ(describe_nrc(outcome->nrc), "conditionsNotCorrect (0x22)");
}

TEST_F(UdsClient, P2AndP2StarWithResponsePending) {
  ask(tester_present_request(false), ms(0));
  EXPECT_EQ(client.next_deadline(), ms(150));
  EXPECT_FALSE(client.on_time(ms(149)));
  EXPECT_FALSE(client.on_frame(frame("648#037F3E78"), ms(149)));
  EXPECT_FALSE(client.on_time(ms(5148)));
  const auto outcome = client.on_time(ms(5149));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::timeout);
}

TEST_F(UdsClient, ResponsePendingHasALimit) {
  ask(tester_present_request(false), ms(0));
  Time now{0};
  std::optional<Outcome> outcome;
  while (!outcome && now < ms(100'000)) {
    outcome = client.on_frame(frame("648#037F3E78"), now);
    now += ms(4000);
    outcome = client.on_time(now);
  }
  ASSERT_TRUE(outcome);
  EXPECT_EQ(now, ms(60'000));
}

TEST_F(UdsClient, LateAnswersToAnotherRequestArePassedOver) {
  ask(read_request(0x0200), ms(0));
  client.cancel();
  EXPECT_FALSE(client.on_frame(frame("648#0462020001"), ms(1)));
  ask(transfer_exit_request(), ms(2));
  EXPECT_FALSE(client.on_frame(frame("648#0462020001"), ms(3)));
  EXPECT_FALSE(client.on_frame(frame("648#037F2231"), ms(3)));
  const auto outcome = client.on_frame(frame("648#0177"), ms(4));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::positive);
}

// ISO 14229-1: the positive response repeats the record's identifier, the routine's with its sub-function.
TEST_F(UdsClient, AnswersToAnotherTesterArePassedOver) {
  ask(read_request(0x0201), ms(0));
  EXPECT_FALSE(client.on_frame(frame("648#0562F18C4142"), ms(10)));
  auto outcome = client.on_frame(frame("648#0462020107"), ms(20));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::positive);
  EXPECT_THAT(outcome->response, ElementsAre(0x62, 0x02, 0x01, 0x07));

  ask(routine_request(RoutineAction::result, 0x0301, {}), ms(30));
  EXPECT_FALSE(client.on_frame(frame("648#0471030302"), ms(40)));
  EXPECT_FALSE(client.on_frame(frame("648#0471010301"), ms(50)));
  outcome = client.on_frame(frame("648#057103030102"), ms(60));
  ASSERT_TRUE(outcome);
  EXPECT_THAT(outcome->response, ElementsAre(0x71, 0x03, 0x03, 0x01, 0x02));
  // Nobody else's answer stops the clock.
  ask(write_request(0x0201, Bytes{1}), ms(100));
  EXPECT_FALSE(client.on_frame(frame("648#036EF18C"), ms(110)));
  outcome = client.on_time(ms(250));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::timeout);
}

TEST_F(UdsClient, BrokenAnswerIsATransportFailure) {
  ask(read_request(0x0210), ms(0));
  EXPECT_FALSE(client.on_frame(frame("648#1014620210010203"), ms(1)));
  EXPECT_THAT(take_all(client, ms(1)), ElementsAre("640#300000CCCCCCCCCC"));
  const auto outcome = client.on_frame(frame("648#2200000000000000"), ms(2));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::transport);
  EXPECT_EQ(outcome->why, isotp::Result::wrong_sequence);
}

// A stranger's long message is received, so that its frames disturb nothing, and passed over; an answer that announces
// more than the request can yield is refused at its first frame.
TEST_F(UdsClient, AnAnswerLongerThanItCanBeIsRefused) {
  ASSERT_TRUE(client.request(read_request(0x0220), ms(0), 64));
  take_all(client, ms(0));
  const auto outcome = client.on_frame(frame("648#1041620220010203"), ms(1));  // 65 bytes
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::too_long);
  EXPECT_EQ(outcome->announced, 65U);
  EXPECT_THAT(take_all(client, ms(1)), ElementsAre("640#320000CCCCCCCCCC"));  // overflow

  ASSERT_TRUE(client.request(read_request(0x0220), ms(10), 64));
  take_all(client, ms(10));
  EXPECT_FALSE(client.on_frame(frame("648#1041620210010203"), ms(11)));
  EXPECT_THAT(take_all(client, ms(11)), ElementsAre("640#300000CCCCCCCCCC"));
  EXPECT_FALSE(client.on_frame(frame("648#1040620220010203"), ms(12)));  // 64 bytes: all that is allowed
}

TEST_F(UdsClient, AnAnswerOf32BitLengthIsRefused) {
  ask(transfer_request(1), ms(0));
  const auto outcome = client.on_frame(frame("648#1000FFFFFFFF7601"), ms(1));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::too_long);
  EXPECT_EQ(outcome->announced, 0xFFFFFFFFU);
  ask(transfer_request(1), ms(2));
  EXPECT_FALSE(client.on_frame(frame("648#1000FFFFFFFF6202"), ms(3)));  // a stranger's
}

// A bus that delivers everything twice: the second seed is not the answer to the key.
TEST_F(UdsClient, AnAnswerThatArrivesTwiceIsNotTheNextOne) {
  const std::pair<Bytes, const char*> dialogue[] = {{session_request(Session::extended), "648#065003003201F4CC"},
                                                    {seed_request(), "648#0667010000000000"},
                                                    {reset_request(ResetType::hard), "648#025101CCCCCCCCCC"},
                                                    {transfer_request(1), "648#047601AABBCCCCCC"},
                                                    {transfer_request(2), "648#047602AABBCCCCCC"}};
  Time now = ms(0);
  const char* last = nullptr;
  for (const auto& [request, answer] : dialogue) {
    ask(request, now);
    if (last != nullptr) {
      EXPECT_FALSE(client.on_frame(frame(last), now)) << last;
    }
    const auto outcome = client.on_frame(frame(answer), now + ms(1));
    ASSERT_TRUE(outcome) << answer;
    EXPECT_EQ(outcome->kind, Outcome::Kind::positive);
    EXPECT_EQ(outcome->passed_over, last == nullptr ? 0U : 1U);
    EXPECT_FALSE(client.on_frame(frame(answer), now + ms(1)));
    last = answer;
    now += ms(10);
  }
  ask(Bytes{0x27, 0x02, 1, 2}, now);
  EXPECT_FALSE(client.on_frame(frame("648#0667010000000000"), now));
  EXPECT_TRUE(client.on_frame(frame("648#026702CCCCCCCCCC"), now));
}

// A negative response repeats the service alone: a second copy of it looks like the answer to the next request of the
// service. It is held until that one's own answer is here.
TEST_F(UdsClient, ARefusalThatArrivesTwiceIsNotTheNextOne) {
  ask(read_request(0x0211), ms(0));
  auto outcome = client.on_frame(frame("648#037F2222"), ms(1));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::negative);
  ask(read_request(0xF18C), ms(2));
  EXPECT_FALSE(client.on_frame(frame("648#037F2222"), ms(3)));
  EXPECT_FALSE(client.on_frame(frame("648#037F2222"), ms(4)));  // nor a third one
  outcome = client.on_frame(frame("648#0562F18C4142"), ms(5));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::positive);
  // Another service in between changes nothing.
  ask(session_request(Session::extended), ms(6));
  ASSERT_TRUE(client.on_frame(frame("648#065003003201F4CC"), ms(7)));
  ask(read_request(0x0200), ms(8));
  EXPECT_FALSE(client.on_frame(frame("648#037F2222"), ms(9)));
  EXPECT_TRUE(client.on_frame(frame("648#0462020001"), ms(10)));
}

// Where no other answer comes within P2 (150 ms), the refusal is this request's own; another reason is it at once, and so
// is the same request refused again.
TEST_F(UdsClient, ARefusalOfItsOwnIsTheOutcome) {
  ask(read_request(0x0211), ms(0));
  ASSERT_TRUE(client.on_frame(frame("648#037F2222"), ms(1)));
  ask(read_request(0x0200), ms(10));
  EXPECT_FALSE(client.on_frame(frame("648#037F2222"), ms(20)));
  EXPECT_FALSE(client.on_time(ms(159)));
  auto outcome = client.on_time(ms(160));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->kind, Outcome::Kind::negative);
  EXPECT_EQ(outcome->nrc, 0x22);
  EXPECT_THAT(outcome->response, ElementsAre(0x7F, 0x22, 0x22));

  ask(read_request(0x0200), ms(200));
  EXPECT_TRUE(client.on_frame(frame("648#037F2222"), ms(201)));
  ask(read_request(0xF18C), ms(210));
  outcome = client.on_frame(frame("648#037F2231"), ms(211));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->nrc, 0x31);
}

// A request that is not out yet can have no answer.
TEST_F(UdsClient, WhatComesBeforeTheRequestIsOutAnswersNone) {
  ASSERT_TRUE(client.request(read_request(0x0200), ms(0)));
  EXPECT_FALSE(client.on_frame(frame("648#037F2231"), ms(0)));
  take_all(client, ms(1));
  EXPECT_TRUE(client.on_frame(frame("648#0462020001"), ms(2)));
}

TEST(UdsClientTimings, WhatTheServerStatesIsTakenUpWithinBounds) {
  ClientTimings configured;
  configured.p2 = ms(1000);
  configured.p2_star = ms(5000);
  EXPECT_EQ(with_stated(configured, {ms(50), ms(5000)}).p2, ms(1000));
  EXPECT_EQ(with_stated(configured, {ms(50), ms(5000)}).p2_star, ms(5100));
  EXPECT_EQ(with_stated(configured, {ms(2000), ms(20000)}).p2, ms(2100));
  EXPECT_EQ(with_stated(configured, {ms(2000), ms(20000)}).p2_star, ms(20100));
  EXPECT_EQ(with_stated(configured, {ms(0), ms(0)}).p2_star, ms(5000));
  // 65.5 s and eleven minutes, the most that the fields hold: a server that states this is not waited for.
  EXPECT_EQ(with_stated(configured, {ms(65535), ms(655350)}).p2, ms(1000));
  EXPECT_EQ(with_stated(configured, {ms(65535), ms(655350)}).p2_star, ms(5000));
}

TEST_F(UdsClient, TesterPresentKeepsTheSession) {
  client.keep_session(true, ms(0));
  EXPECT_EQ(client.next_deadline(), ms(2000));
  client.on_time(ms(2000));
  EXPECT_THAT(take_all(client, ms(2000)), ElementsAre("7DF#023E80CCCCCCCCCC"));
  client.keep_session(false, ms(2001));
  EXPECT_EQ(client.next_deadline(), std::nullopt);
}

TEST(UdsMessages, RequestsAreLiteral) {
  EXPECT_EQ(session_request(Session::extended), (Bytes{0x10, 3}));
  EXPECT_EQ(reset_request(ResetType::hard), (Bytes{0x11, 1}));
  EXPECT_EQ(seed_request(), (Bytes{0x27, 1}));
  EXPECT_EQ(key_request(Bytes{9, 8}), (Bytes{0x27, 2, 9, 8}));
  EXPECT_EQ(write_request(0x0202, Bytes{1}), (Bytes{0x2E, 2, 2, 1}));
  EXPECT_EQ(routine_request(RoutineAction::start, 0x0301, Bytes{0, 0, 0, 5}), (Bytes{0x31, 1, 3, 1, 0, 0, 0, 5}));
  EXPECT_EQ(upload_request(0x01020304, 0x1000), (Bytes{0x35, 0, 0x44, 1, 2, 3, 4, 0, 0, 0x10, 0}));
  EXPECT_EQ(memory_request(0x80000102, 0x200, {4, 2}), (Bytes{0x23, 0x24, 0x80, 0, 1, 2, 2, 0}));
  EXPECT_EQ(transfer_request(255), (Bytes{0x36, 255}));
  EXPECT_EQ(transfer_exit_request(), (Bytes{0x37}));
}

TEST(UdsMessages, ReadMemoryByAddress) {
  const auto range = parse_memory_request(Bytes{0x23, 0x24, 0x80, 0, 1, 2, 2, 0}, {4, 2});
  ASSERT_TRUE(range);
  EXPECT_EQ(range->address, 0x80000102U);
  EXPECT_EQ(range->bytes, 0x200U);
  EXPECT_EQ(parse_memory_request(Bytes{0x23, 0x14, 0x80, 0, 1, 2, 2}, {4, 2}).error(), Nrc::request_out_of_range);
  EXPECT_EQ(parse_memory_request(Bytes{0x23, 0x24, 0x80, 0, 1, 2, 2}, {4, 2}).error(), Nrc::incorrect_message_length);
  EXPECT_EQ(parse_memory_request(Bytes{0x23, 0x24}, {4, 2}).error(), Nrc::incorrect_message_length);
  EXPECT_EQ(memory_response(Bytes{7, 8}), (Bytes{0x63, 7, 8}));
  const Bytes response{0x63, 7, 8};
  EXPECT_EQ(read_memory_response(response, 2)->size(), 2U);
  EXPECT_EQ(read_memory_response(response, 3).error().message,
            "ReadMemoryByAddress: 2 bytes in answer to a request for 3");
}

// ISO 14229-1, 10.8: format, address and size, which the response repeats; then as many bytes.
TEST(UdsMessages, WriteMemoryByAddress) {
  const UploadFormat format{3, 1};
  const Bytes request{0x3D, 0x13, 4, 0x80, 0, 2, 0xA, 0xB};
  EXPECT_EQ(write_memory_request(0x048000, Bytes{0xA, 0xB}, format), request);
  const auto write = parse_write_memory_request(request, format);
  ASSERT_TRUE(write);
  EXPECT_EQ(write->range.address, 0x048000U);
  EXPECT_EQ(Bytes(write->data.begin(), write->data.end()), (Bytes{0xA, 0xB}));
  const auto refused = [&](const Bytes& bytes) { return parse_write_memory_request(bytes, format).error(); };
  EXPECT_EQ(refused({0x3D, 0x13, 4, 0x80}), Nrc::incorrect_message_length);
  EXPECT_EQ(refused({0x3D, 0x23, 4, 0x80, 0, 2, 0xA, 0xB}), Nrc::request_out_of_range);
  EXPECT_EQ(refused({0x3D, 0x13, 4, 0x80, 0}), Nrc::incorrect_message_length);
  EXPECT_EQ(refused({0x3D, 0x13, 4, 0x80, 0, 3, 0xA, 0xB}), Nrc::incorrect_message_length);
  EXPECT_EQ(refused({0x3D, 0x13, 4, 0x80, 0, 1, 0xA, 0xB}), Nrc::incorrect_message_length);
  EXPECT_EQ(write_memory_response(write->range, format), (Bytes{0x7D, 0x13, 4, 0x80, 0, 2}));
  EXPECT_TRUE(read_write_memory_response(Bytes{0x7D, 0x13, 4, 0x80, 0, 2}, 0x048000, 2, format));
  const auto fault = [&](const Bytes& response) {
    return read_write_memory_response(response, 0x048000, 2, format).error().message;
  };
  EXPECT_EQ(fault({0x7D, 0x13, 4, 0x80, 1, 2}),
            "WriteMemoryByAddress: byte 4 of the response is 0x01, the request had 0x00");
  EXPECT_EQ(fault({0x7D, 0x13, 4, 0x80, 0}), "WriteMemoryByAddress: the response has only 5 bytes");
  EXPECT_EQ(fault({0x7D, 0x13, 4, 0x80, 0, 2, 0}), "WriteMemoryByAddress: a response of 7 bytes, 6 expected");
}

// ISO 14229-1, 14.6: mode 4 reads a file; its name's length in two bytes, the name, the format of the data.
TEST(UdsMessages, RequestFileTransfer) {
  const Bytes request{0x38, 4, 0, 6, '/', 'r', '/', '7', '.', 'b', 0};
  EXPECT_EQ(file_request("/r/7.b"), request);
  EXPECT_EQ(parse_file_request(request).value(), "/r/7.b");
  const auto refused = [&request](std::size_t at, std::uint8_t byte) {
    Bytes other = request;
    other[at] = byte;
    return parse_file_request(other).error();
  };
  EXPECT_EQ(refused(1, 3), Nrc::request_out_of_range);      // ReplaceFile
  EXPECT_EQ(refused(3, 5), Nrc::incorrect_message_length);  // a name shorter than it is
  EXPECT_EQ(refused(3, 7), Nrc::incorrect_message_length);  // longer
  EXPECT_EQ(refused(2, 1), Nrc::incorrect_message_length);  // of 262 bytes
  EXPECT_EQ(refused(10, 0x10), Nrc::request_out_of_range);  // compressed
  EXPECT_EQ(parse_file_request(Bytes{0x38, 4, 0, 0, 0}).error(), Nrc::incorrect_message_length);
}

// Its answer: bytes of a block's length, that length, the format, bytes of a size in two bytes, the size, the size compressed.
TEST(UdsMessages, TheAnswerToRequestFileTransfer) {
  const Bytes response{0x78, 4, 2, 0x0F, 0xFF, 0, 0, 3, 0, 4, 0, 0, 4, 0};
  const auto answer = read_file_response(response);
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->longest, 4095U);
  EXPECT_EQ(answer->bytes, 1024U);
  EXPECT_EQ(file_response(4095, 1024), (Bytes{0x78, 4, 4, 0, 0, 0x0F, 0xFF, 0, 0, 4, 0, 0, 4, 0, 0, 0, 4, 0}));
  EXPECT_EQ(read_file_response(file_response(302, 2048))->bytes, 2048U);
  for (std::size_t bytes = 0; bytes < response.size(); ++bytes) {
    EXPECT_FALSE(read_file_response(ByteView(response).first(bytes))) << bytes;
  }
  const auto wrong = [&response](std::size_t at, std::uint8_t byte) {
    Bytes other = response;
    other[at] = byte;
    const auto read = read_file_response(other);
    return read ? "" : read.error().message;
  };
  EXPECT_THAT(wrong(1, 3), HasSubstr("byte 1 of the response is 0x03, the request had 0x04"));
  EXPECT_THAT(wrong(2, 5), HasSubstr("a block's length of 5 bytes"));
  EXPECT_THAT(wrong(5, 0x11), HasSubstr("compressed or encrypted data"));
  EXPECT_THAT(wrong(6, 1), HasSubstr("a file's size of 259 bytes"));
  EXPECT_THAT(wrong(13, 1), HasSubstr("compressed or encrypted data"));  // 1024 bytes in 1025
  Bytes empty = response;
  empty[3] = 0, empty[4] = 2;
  EXPECT_THAT(read_file_response(empty).error().message, HasSubstr("blocks without data"));
}

TEST(UdsMessages, ResponsesAreReadAndChecked) {
  const auto timings = read_session_response(Bytes{0x50, 3, 0, 50, 1, 0xF4}, Session::extended);
  ASSERT_TRUE(timings);
  EXPECT_EQ(timings->p2, ms(50));
  EXPECT_EQ(timings->p2_star, ms(5000));
  EXPECT_EQ(session_response(Session::extended, *timings), (Bytes{0x50, 3, 0, 50, 1, 0xF4}));
  EXPECT_EQ(read_upload_response(Bytes{0x75, 0x20, 0x0F, 0xFF}).value(), 4095U);
  EXPECT_EQ(read_upload_response(upload_response(65535)).value(), 65535U);
  EXPECT_FALSE(read_upload_response(Bytes{0x75, 0x50, 1, 2, 3, 4, 5}));
  EXPECT_FALSE(read_upload_response(Bytes{0x75, 0x10, 2}));
  const auto wrong = read_transfer_response(Bytes{0x76, 5, 1, 2}, 4);
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("TransferData: byte 1 of the response is 0x05, the request had 0x04"));
  EXPECT_FALSE(read_seed_response(Bytes{0x67, 1, 0}));
}

// RFC 4493, examples 2: key, message and tag of the document.
TEST(UdsSecurity, AesCmacOfTheStandard) {
  const SecurityKey key = {0x2b, 0x7e, 0x15, 0x16, 0x28, 0xae, 0xd2, 0xa6,
                           0xab, 0xf7, 0x15, 0x88, 0x09, 0xcf, 0x4f, 0x3c};
  const Bytes message = {0x6b, 0xc1, 0xbe, 0xe2, 0x2e, 0x40, 0x9f, 0x96,
                         0xe9, 0x3d, 0x7e, 0x11, 0x73, 0x93, 0x17, 0x2a};
  const Bytes tag = {0x07, 0x0a, 0x16, 0xb4, 0x6b, 0x4d, 0x41, 0x44, 0xf7, 0x9b, 0xdd, 0x9d, 0xd0, 0x4a, 0x28, 0x7c};
  const auto answer = answer_seed(key, message);
  ASSERT_TRUE(answer);
  EXPECT_TRUE(equal_in_constant_time(*answer, tag));
  EXPECT_FALSE(equal_in_constant_time(*answer, Bytes(16, 0)));
}

}  // namespace
}  // namespace selfcal::uds
