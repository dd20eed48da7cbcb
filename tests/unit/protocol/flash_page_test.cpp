#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string_view>

#include "protocol/flash/crc32c.hpp"
#include "protocol/flash/page.hpp"

namespace selfcal::flash {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(Crc32c, CheckValuesOfTheStandard) {
  EXPECT_EQ(crc32c(bytes_of("123456789")), 0xE3069283U);
  EXPECT_EQ(crc32c(std::array<std::uint8_t, 32>{}), 0x8A9136AAU);  // RFC 3720, B.4
  EXPECT_EQ(crc32c(bytes_of("6789"), crc32c(bytes_of("12345"))), 0xE3069283U);
}

Page sample_page() {
  Page page;
  page.run_id = 7;
  page.sequence = 3;
  page.first_sample = 435;
  page.temperature_c = -12.34;
  page.flags = page_flag::last_of_run;
  page.samples = {{{1, -2, 0x7FFFFFFF}, {-1, 0, 5}, 0x4000, 0xFFFF}};
  return page;
}

TEST(FlashPage, HeaderAndSampleAreLiteral) {
  PageBytes bytes{};
  encode_page(sample_page(), bytes);
  const std::array<std::uint8_t, 32> header = {'S', 'C', 'R', 'P', 0, 1, 0, 1,    0,    0,    0, 7, 0, 0, 0, 3,
                                               0,   0,   0,   0,   0, 0, 1, 0xB3, 0xFB, 0x2E, 0, 1, 0, 0, 0, 0};
  EXPECT_TRUE(std::equal(header.begin(), header.end(), bytes.begin()));
  const std::array<std::uint8_t, 28> sample = {0,    0,    0,    1,    0xFF, 0xFF, 0xFF, 0xFE, 0x7F, 0xFF,
                                               0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0,    0,    0,    0,
                                               0,    0,    0,    5,    0x40, 0,    0xFF, 0xFF};
  EXPECT_TRUE(std::equal(sample.begin(), sample.end(), bytes.begin() + page_header_bytes));
  EXPECT_EQ(bytes[page_bytes - 1], 0xFF);
}

TEST(FlashPage, FullPageComesBack) {
  Page page = sample_page();
  page.samples.assign(samples_per_page, page.samples[0]);
  PageBytes bytes{};
  encode_page(page, bytes);
  Page read;
  ASSERT_TRUE(decode_page(bytes, read));
  EXPECT_EQ(read.samples, page.samples);
  EXPECT_EQ(read.first_sample, page.first_sample);
  EXPECT_DOUBLE_EQ(read.temperature_c, page.temperature_c);
  EXPECT_EQ(page_header_bytes + samples_per_page * sample_bytes, page_bytes);
}

// CRC-32C finds every error of up to 5 bits in messages of this length (Hamming distance 6 up to 5243 bits, 4 beyond),
// so of one bit certainly.
RC_GTEST_PROP(FlashPage, AnyFlippedBitIsFound, ()) {
  PageBytes bytes{};
  encode_page(sample_page(), bytes);
  const auto bit = *rc::gen::inRange<std::size_t>(0, page_bytes * 8);
  bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << (bit % 8));
  Page read;
  RC_ASSERT(!decode_page(bytes, read).has_value());
}

TEST(FlashPage, ErrorsAreNamed) {
  PageBytes bytes{};
  encode_page(sample_page(), bytes);
  Page read;
  EXPECT_EQ(decode_page(std::span(bytes).first(4095), read).error(), PageError::wrong_size);
  PageBytes erased;
  erased.fill(0xFF);
  EXPECT_EQ(decode_page(erased, read).error(), PageError::bad_magic);
  bytes[100] ^= 1;
  EXPECT_EQ(decode_page(bytes, read).error(), PageError::bad_crc);
}

}  // namespace
}  // namespace selfcal::flash
