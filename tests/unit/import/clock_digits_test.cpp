// Times of the day whose digits stand in one number.
#include "protocol/import/clock_digits.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <functional>

#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::HasSubstr;

class ClockDigits : public ::testing::Test {
 protected:
  // A reading before it, as nobody's time stands first.
  std::unique_ptr<ColumnSource> open(int rows, const std::function<double(int)>& value) {
    std::ofstream file(folder_ / "log.csv");
    file << "gx,utc\n";
    for (int row = 0; row < rows; ++row) {
      file << fmt::format("{},{:.2f}\n", row % 3 - 1, value(row));
    }
    file.close();
    auto source = open_columns(folder_ / "log.csv");
    return source ? std::move(*source) : nullptr;
  }
  static double digits(double seconds) {
    const double day = std::fmod(seconds, 86400.0);
    return 10000.0 * std::floor(day / 3600.0) + 100.0 * std::floor(std::fmod(day, 3600.0) / 60.0) +
           std::fmod(day, 60.0);
  }
  test::TemporaryFolder folder_;
};

TEST_F(ClockDigits, AreSecondsOfTheDay) {
  for (const double begin : {45296.0, 86350.0, 0.0}) {
    const auto source = open(8000, [begin](int row) { return digits(begin + 0.05 * row); });
    ASSERT_TRUE(source);
    EXPECT_THAT(source->put_together(), HasSubstr("column 2 (utc) is a time of the day")) << begin;
    EXPECT_EQ(source->units()[1], "s");
    ColumnRequest request;
    request.columns = {0, 1};
    request.stamp = 1;
    const auto data = source->read(request);
    ASSERT_TRUE(data);
    for (std::size_t row = 0; row < data->rows; ++row) {
      const double truth = std::fmod(begin + 0.05 * static_cast<double>(row), 86400.0);
      ASSERT_NEAR(static_cast<double>(data->stamps[row]), truth, 1e-6) << row;
      ASSERT_NEAR(data->values[1][row], truth, 1e-6) << row;
    }
  }
}

TEST_F(ClockDigits, SecondsAreNone) {
  EXPECT_EQ(open(8000, [](int row) { return 0.05 * row; })->put_together(), "") << "seconds through 60 to 99";
  EXPECT_EQ(open(1500, [](int row) { return 120000.0 + 0.03 * row; })->put_together(), "") << "45 s alone";
  EXPECT_EQ(open(8000, [](int row) { return 3.0 * (row % 7); })->put_together(), "") << "what does not rise";
  EXPECT_EQ(open(8000, [](int row) { return 100.0 * row; })->put_together(), "") << "hundreds, minutes beyond 60";
}

}  // namespace
}  // namespace selfcal::import
