// LCM messages of strangers: refused without an exception, whatever they say about lengths and counts.
#include "protocol/lcm/decode.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace selfcal::lcm_messages {
namespace {

constexpr std::size_t text_length_at = 20;  // behind hash (8), schema (4) and utime_us (8), in all messages with a text

template <typename Message>
std::vector<std::uint8_t> encoded(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  EXPECT_EQ(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  return bytes;
}

std::vector<std::uint8_t> with_int(std::vector<std::uint8_t> bytes, std::size_t place, std::int32_t value) {
  for (std::size_t k = 0; k < 4; ++k) {
    bytes.at(place + k) = static_cast<std::uint8_t>(static_cast<std::uint32_t>(value) >> (24 - 8 * k));
  }
  return bytes;
}

selfcal_lcm::estimate estimate_of_two() {
  selfcal_lcm::estimate message{};
  message.ins = "bench";
  message.count = 2;
  message.name = {"accel_bias_x", "accel_bias_y"};
  message.unit = {"ug", "ug"};
  message.value = {1.0, -2.0};
  message.sigma = {0.5, 0.25};
  message.tolerance = {1.0, 1.0};
  return message;
}

TEST(LcmDecode, WhatTheDaemonSendsIsRead) {
  const auto read = decode<selfcal_lcm::estimate>(encoded(estimate_of_two()));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->name, estimate_of_two().name);
  EXPECT_EQ(read->sigma, estimate_of_two().sigma);
  selfcal_lcm::alarm alarm{};
  alarm.ins = "bench";
  alarm.text = "gimbal stuck";
  const auto heard = decode<selfcal_lcm::alarm>(encoded(alarm));
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->text, "gimbal stuck");
}

// A message of each type whose texts have the length that the test says: the table of fields fits the types.
template <typename Message>
void lengths_of(const Message& message) {
  const auto whole = encoded(message);
  EXPECT_TRUE(detail::lengths_are_sound(detail::fields<Message>, whole));
  EXPECT_FALSE(detail::lengths_are_sound(detail::fields<Message>, {whole.data(), whole.size() - 1}));
  EXPECT_TRUE(decode<Message>(whole));
}

TEST(LcmDecode, TheTablesOfFieldsFitTheTypes) {
  lengths_of(estimate_of_two());
  selfcal_lcm::ins_status ins{};
  ins.ins = "bench";
  ins.state = "rotating";
  lengths_of(ins);
  selfcal_lcm::service_status service{};
  service.software = "1.0";
  lengths_of(service);
  selfcal_lcm::alarm alarm{};
  alarm.text = "gimbal stuck";
  lengths_of(alarm);
}

TEST(LcmDecode, APartOfAMessageIsNone) {
  const auto whole = encoded(estimate_of_two());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(decode<selfcal_lcm::estimate>({whole.data(), size})) << size;
  }
  EXPECT_FALSE(decode<selfcal_lcm::alarm>(whole));  // another type: another hash
  EXPECT_FALSE(decode<selfcal_lcm::estimate>(std::vector<std::uint8_t>(longest + 1)));
}

TEST(LcmDecode, LengthsAndCountsThatCannotBeAreRefused) {
  const auto whole = encoded(estimate_of_two());
  const std::size_t count_at = text_length_at + 4 + sizeof "bench" + 20;
  ASSERT_TRUE(decode<selfcal_lcm::estimate>(with_int(whole, count_at, 2)));
  selfcal_lcm::ins_status status{};
  status.ins = "bench";
  for (const std::int32_t value : {-1, 1000, 1'000'000, 0x7FFFFFFF, -0x7FFFFFFF - 1}) {
    EXPECT_FALSE(decode<selfcal_lcm::estimate>(with_int(whole, count_at, value))) << value;
    EXPECT_FALSE(decode<selfcal_lcm::estimate>(with_int(whole, text_length_at, value))) << value;
    EXPECT_FALSE(decode<selfcal_lcm::ins_status>(with_int(encoded(status), text_length_at, value))) << value;
  }
  // Not even its NUL; and the second text, whose length lcm-gen's decoder does not survive.
  EXPECT_FALSE(decode<selfcal_lcm::ins_status>(with_int(encoded(status), text_length_at, 0)));
  const std::size_t second_at = text_length_at + 4 + sizeof "bench";
  EXPECT_FALSE(decode<selfcal_lcm::ins_status>(with_int(encoded(status), second_at, -0x7FFFFFFF - 1)));
}

}  // namespace
}  // namespace selfcal::lcm_messages
