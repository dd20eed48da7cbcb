// Words whose halves stand in two columns each.
#include "protocol/import/word_halves.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <random>
#include <string>

#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::HasSubstr;

class WordHalves : public ::testing::Test {
 protected:
  using Halves = std::function<std::array<std::int64_t, 2>(std::int64_t word)>;

  // Three axes that swing by `size` counts with noise of `noise`; names of the first and the second half behind the axis.
  std::unique_ptr<ColumnSource> open(const std::array<std::string, 2>& names, const Halves& halves, double size,
                                     double noise) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::ofstream file(folder_ / "log.csv");
    for (const char axis : {'x', 'y', 'z'}) {
      file << fmt::format("{}g{}_{},g{}_{}", axis == 'x' ? "" : ",", axis, names[0], axis, names[1]);
    }
    file << "\n";
    words_.clear();
    for (int row = 0; row < rows; ++row) {
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t value = std::llround(size * std::sin(0.003 * row + axis) + noise * normal(random));
        words_.push_back(value);
        const auto [first, second] = halves(value);
        file << fmt::format("{}{},{}", axis == 0 ? "" : ",", first, second);
      }
      file << "\n";
    }
    file.close();
    auto source = open_columns(folder_ / "log.csv");
    return source ? std::move(*source) : nullptr;
  }
  void expect_words(const ColumnSource& source, std::size_t high) const {
    ColumnRequest request;
    request.columns = {high, high + 2, high + 4, high};
    const auto data = source.read(request);
    ASSERT_TRUE(data);
    ASSERT_EQ(data->values.size(), 4U);
    for (std::size_t row = 0; row < data->rows; ++row) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(data->values[axis][row], static_cast<double>(words_[3 * row + axis])) << row;
      }
      ASSERT_EQ(data->values[3][row], data->values[0][row]);
    }
  }

  static constexpr int rows = 4000;
  static constexpr double word = 65536.0;
  std::vector<std::int64_t> words_;
  test::TemporaryFolder folder_;
};

std::array<std::int64_t, 2> low_first(std::int64_t w) { return {w & 0xFFFF, w >> 16}; }

TEST_F(WordHalves, AreOneWordWithAndWithoutSigns) {
  const auto noisy = open({"LOW", "OUT"}, low_first, 1e3 * word, 5.0 * word);
  ASSERT_TRUE(noisy);
  EXPECT_THAT(noisy->put_together(), HasSubstr("words of 32 bits"));
  EXPECT_THAT(noisy->put_together(), HasSubstr("columns 2 and 1, 4 and 3, 6 and 5"));
  EXPECT_TRUE(noisy->names()[0].ends_with(low_half));
  expect_words(*noisy, 1);
  const auto quiet = open({"low", "high"}, low_first, 100.0 * word, 0.01 * word);
  ASSERT_TRUE(quiet);
  expect_words(*quiet, 1);
  const auto other = open(
      {"msw", "lsw"},
      [](std::int64_t w) {
        return std::array<std::int64_t, 2>{(w >> 16) & 0xFFFF, static_cast<std::int16_t>(w & 0xFFFF)};
      },
      1e3 * word, word);
  ASSERT_TRUE(other);
  expect_words(*other, 0);
}

TEST_F(WordHalves, OfBytes) {
  const auto bytes = open(
      {"H", "L"},
      [](std::int64_t w) {
        return std::array<std::int64_t, 2>{w >> 8, w & 0xFF};
      },
      8000.0, 10.0);
  ASSERT_TRUE(bytes);
  EXPECT_THAT(bytes->put_together(), HasSubstr("words of 16 bits"));
  expect_words(*bytes, 0);
}

TEST_F(WordHalves, WhatTheNumbersDoNotBearOutIsLeftAlone) {
  const auto alone = [&](const Halves& halves, const char* what) {
    const auto source = open({"high", "low"}, halves, 1e3 * word, 5.0 * word);
    ASSERT_TRUE(source) << what;
    EXPECT_EQ(source->put_together(), "") << what;
    EXPECT_EQ(source->names()[1], "gx_low") << what;
  };
  alone(low_first, "the wrong way round");
  alone([](std::int64_t w) { return std::array<std::int64_t, 2>{w >> 16, 0}; }, "nothing in the low ones");
  alone([](std::int64_t w) { return std::array<std::int64_t, 2>{w >> 18, w >> 14}; }, "two ranges");
  alone([](std::int64_t w) { return std::array<std::int64_t, 2>{w >> 16, w >> 16}; }, "one value twice");
}

}  // namespace
}  // namespace selfcal::import
