// A column of intervals in the place of a time.
#include "protocol/import/summed_intervals.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <string>

#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::HasSubstr;

class SummedIntervals : public ::testing::Test {
 protected:
  // Two columns: the named one, and what does not rise.
  std::unique_ptr<ColumnSource> open(const std::string& name, const std::function<std::string(int)>& value,
                                     const std::string& other = "gx", int rising = 0) {
    std::ofstream file(folder_ / "log.csv");
    file << name << "," << other << "\n";
    for (int row = 0; row < rows; ++row) {
      file << value(row) << "," << rising * row + (row % 3 - 1) * (1 - rising) << "\n";
    }
    file.close();
    auto source = open_columns(folder_ / "log.csv");
    return source ? std::move(*source) : nullptr;
  }
  static ColumnData stamps(const ColumnSource& source) {
    ColumnRequest request;
    request.stamp = 0;
    request.columns = {0, 1};
    request.tolerant = true;
    return *source.read(request);
  }

  static constexpr int rows = 40;
  test::TemporaryFolder folder_;
};

TEST_F(SummedIntervals, AreATimeWithItsGaps) {
  for (const char* name : {"dt", "dt_us", "delta_t [ms]", "DeltaTime", "Time delta (s)", "timestep_ms"}) {
    const auto source = open(name, [](int row) { return row == 20 ? "250" : row == 0 ? "0" : "10"; });
    ASSERT_TRUE(source);
    EXPECT_THAT(source->put_together(), HasSubstr("time is the sum of the intervals in column 1")) << name;
    const ColumnData data = stamps(*source);
    for (int row = 0; row < rows; ++row) {
      const double truth = 10.0 * row + (row >= 20 ? 240.0 : 0.0);
      EXPECT_DOUBLE_EQ(static_cast<double>(data.stamps[static_cast<std::size_t>(row)]), truth) << name << row;
      EXPECT_DOUBLE_EQ(data.values[0][static_cast<std::size_t>(row)], truth) << name << row;
    }
    EXPECT_DOUBLE_EQ(data.values[1][7], 7 % 3 - 1);
  }
}

// The row has no time; those behind it are where they were.
TEST_F(SummedIntervals, RowWithoutOne) {
  const auto source = open("dt", [](int row) { return row == 5 ? "" : "0.01"; });
  ASSERT_TRUE(source);
  const ColumnData data = stamps(*source);
  EXPECT_TRUE(std::isnan(data.values[0][5]));
  EXPECT_NEAR(data.values[0][6], 0.07, 1e-12);
}

TEST_F(SummedIntervals, LeavesAloneWhatIsNone) {
  const auto steady = [](int /*row*/) { return "0.01"; };
  EXPECT_THAT(open("dtheta", steady)->put_together(), "") << "another name";
  EXPECT_THAT(open("dT", [](int row) { return fmt::format("{}", std::sin(row)); })->put_together(), "")
      << "a temperature's difference has both signs";
  EXPECT_THAT(open("dt", [](int row) { return fmt::format("{}", std::pow(1.3, row)); })->put_together(), "")
      << "not of one size";
  EXPECT_THAT(open("dt", steady, "stamp", 1)->put_together(), "") << "a time stands beside it";
}

}  // namespace
}  // namespace selfcal::import
