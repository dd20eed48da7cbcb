// Clocks that begin again where they are full, and rows that were written twice.
#include "protocol/import/time_steps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace selfcal::import {
namespace {

// `count` stamps, `step` apart, of a clock that is full at `size` and begins at `first`.
std::vector<long double> clock(long double first, long double step, long double size, std::size_t count) {
  std::vector<long double> stamps;
  for (std::size_t k = 0; k < count; ++k) {
    stamps.push_back(std::fmod(first + step * static_cast<long double>(k), size));
  }
  return stamps;
}

TEST(TimeSteps, FullClocksGoOn) {
  struct Case {
    long double first, step, size;
  };
  // SampleTimeFine of Xsens, a packet counter, sensortime of a BMI270, a GPS week, a day in ms.
  for (const Case& c : {Case{4294960000.0L, 100.0L, 4294967296.0L}, Case{65530.0L, 1.0L, 65536.0L},
                        Case{16777000.0L, 256.0L, 16777216.0L}, Case{604799.5L, 0.01L, 604800.0L},
                        Case{86399990.0L, 5.0L, 86400000.0L}}) {
    std::vector<long double> stamps = clock(c.first, c.step, c.size, 1000);
    EXPECT_NE(continue_full_clocks(stamps), "");
    for (std::size_t k = 1; k < stamps.size(); ++k) {
      ASSERT_NEAR(static_cast<double>(stamps[k] - stamps[k - 1]), static_cast<double>(c.step), 1e-6) << k;
    }
  }
}

TEST(TimeSteps, RowsMayBeLostWhereAClockBeginsAgain) {
  std::vector<long double> stamps = clock(86399.0L, 0.01L, 86400.0L, 1000);
  stamps.erase(stamps.begin() + 98, stamps.begin() + 105);
  EXPECT_NE(continue_full_clocks(stamps), "");
  EXPECT_NEAR(static_cast<double>(stamps[98] - stamps[97]), 0.08, 1e-6);
  std::vector<long double> whole;  // 50 rows a second of a clock that shows whole ones
  for (int row = 0; row < 1000; ++row) {
    whole.push_back(std::fmod(std::floor(86390.0L + 0.02L * row), 86400.0L));
  }
  EXPECT_NE(continue_full_clocks(whole), "");
  EXPECT_EQ(whole.back(), 86409.0L);
}

// In s, in ms, and in ns since 1970: the second before midnight stands twice.
TEST(TimeSteps, ALeapSecondGoesOn) {
  for (const long double unit : {1.0L, 1e3L, 1e9L}) {
    std::vector<long double> stamps = clock(1483228798.0L * unit, 0.01L * unit, 1e30L, 600);
    for (std::size_t k = 250; k < stamps.size(); ++k) {
      stamps[k] -= unit;
    }
    EXPECT_NE(continue_full_clocks(stamps).find("leap second"), std::string::npos);
    for (std::size_t k = 1; k < stamps.size(); ++k) {
      ASSERT_NEAR(static_cast<double>((stamps[k] - stamps[k - 1]) / unit), 0.01, 1e-6) << k;
    }
  }
  std::vector<long double> often = clock(5000.0L, 0.01L, 1e9L, 1000);  // what falls twice is no leap second
  for (std::size_t k = 0; k < often.size(); ++k) {
    often[k] -= k >= 300 ? k >= 700 ? 2.0L : 1.0L : 0.0L;
  }
  EXPECT_EQ(continue_full_clocks(often), "");
}

TEST(TimeSteps, AClockThatIsSetBackStaysBack) {
  for (const long double back : {0.5L, 94.0L, 3600.0L}) {
    std::vector<long double> stamps = clock(5000.0L, 0.01L, 1e9L, 1000);
    for (std::size_t k = 500; k < stamps.size(); ++k) {
      stamps[k] -= back;
    }
    const std::vector<long double> before = stamps;
    EXPECT_EQ(continue_full_clocks(stamps), "");
    EXPECT_EQ(stamps, before);
  }
}

// 128 Hz in stamps of 10 ms; blocks of ten rows with one stamp. A stamp that stands twice is a fault, and of a clock that stops nobody knows.
TEST(TimeSteps, CoarseStampsAreSpread) {
  for (const long double unit : {10.0L, 78.125L}) {
    std::vector<long double> stamps;
    for (int k = 0; k < 1000; ++k) {
      stamps.push_back(std::floor(7.8125L * static_cast<long double>(k) / unit) * unit);
    }
    EXPECT_NE(spread_coarse_stamps(stamps), "");
    for (std::size_t k = 1; k < stamps.size(); ++k) {
      ASSERT_GT(stamps[k], stamps[k - 1]) << k;
      ASSERT_NEAR(static_cast<double>(stamps[k]), 7.8125 * static_cast<double>(k), static_cast<double>(unit)) << k;
    }
  }
  std::vector<long double> once = clock(0.0L, 10.0L, 1e9L, 1000);
  once[500] = once[499];
  EXPECT_EQ(spread_coarse_stamps(once), "");
  std::vector<long double> stopped = clock(0.0L, 10.0L, 1e9L, 1000);
  std::fill(stopped.begin() + 500, stopped.begin() + 700, stopped[500]);
  EXPECT_EQ(spread_coarse_stamps(stopped), "");
  std::vector<long double> falls = clock(0.0L, 10.0L, 5000.0L, 1000);
  EXPECT_EQ(spread_coarse_stamps(falls), "");
}

ColumnData data(std::size_t rows) {
  ColumnData d;
  d.values.resize(2);
  for (std::size_t k = 0; k < rows; ++k) {
    d.values[0].push_back(static_cast<double>(k));
    d.values[1].push_back(std::sin(static_cast<double>(k)));
    d.stamps.push_back(static_cast<long double>(k));
  }
  d.rows = rows;
  return d;
}

void repeat(std::size_t row, ColumnData& d) {
  for (std::vector<double>& v : d.values) {
    v.insert(v.begin() + static_cast<std::ptrdiff_t>(row), v[row]);
  }
  d.stamps.insert(d.stamps.begin() + static_cast<std::ptrdiff_t>(row), d.stamps[row]);
  ++d.rows;
}

TEST(TimeSteps, RowsThatStandTwice) {
  ColumnData d = data(200);
  repeat(20, d);
  repeat(90, d);
  const LeftOutRows lost = rows_to_leave_out(d, 0.01);
  EXPECT_EQ(lost.repeated, 2);
  EXPECT_TRUE(lost.rows[21] && lost.rows[91]);
  d.values[1][91] += 0.1;  // another reading at the same time is no row written twice
  EXPECT_FALSE(repeated_rows(d)[91]);
}

TEST(TimeSteps, ACoarseSensorAtRestIsNoRowWrittenTwice) {
  ColumnData d = data(200);
  d.stamps.clear();
  for (std::size_t k = 0; k < d.rows; ++k) {
    d.values[0][k] = k % 23 == 0 ? 1.0 : 0.0;  // counts, and no column that goes on
    d.values[1][k] = k % 29 == 0 ? 1.0 : 0.0;
  }
  EXPECT_EQ(rows_to_leave_out(d, 0.01).repeated, 0);
}

// 100 rows a second of a clock that shows whole seconds, begun in the middle of one: every row is where it was to half an interval.
TEST(TimeSteps, WholeSecondsAreSpread) {
  std::vector<long double> stamps;
  for (int row = 0; row < 1000; ++row) {
    stamps.push_back(std::floor(0.605L + 0.01L * row));
  }
  EXPECT_NE(spread_coarse_stamps(stamps), "");
  for (std::size_t row = 0; row < stamps.size(); ++row) {
    EXPECT_NEAR(static_cast<double>(stamps[row]), 0.605 + 0.01 * static_cast<double>(row), 0.005 + 1e-9);
  }
}

TEST(TimeSteps, AWholeSecondThatStandsTwiceIsTwo) {
  std::vector<long double> stamps;
  for (int row = 0; row < 3000; ++row) {
    stamps.push_back(std::floor(0.605L + 0.01L * row) - (row >= 940 ? 1.0L : 0.0L));
  }
  EXPECT_NE(spread_coarse_stamps(stamps).find("leap second"), std::string::npos);
  for (std::size_t row = 0; row < stamps.size(); ++row) {
    EXPECT_NEAR(static_cast<double>(stamps[row]), 0.605 + 0.01 * static_cast<double>(row), 0.005 + 1e-9);
  }
}

TEST(TimeSteps, PartsWhoseTimeBeginsAnew) {
  const auto parts = [](std::initializer_list<int> rows) {
    std::vector<long double> stamps;
    for (const int count : rows) {
      for (int row = 1; row <= count; ++row) {
        stamps.push_back(0.01L * row);
      }
    }
    return stamps;
  };
  std::vector<long double> three = parts({100, 100, 100});
  EXPECT_NE(put_parts_behind(three).find("2 times"), std::string::npos);
  EXPECT_TRUE(std::is_sorted(three.begin(), three.end()));
  EXPECT_NEAR(static_cast<double>(three[100] - three[99]), 60.0, 1e-9);  // 6000 intervals of 0.01
  std::vector<long double> sensors = parts({100, 100});                  // one under another
  EXPECT_EQ(put_parts_behind(sensors), "");
  std::vector<long double> back = parts({100, 120});
  back[100] = 0.5L;  // falls to elsewhere
  EXPECT_EQ(put_parts_behind(back), "");
}

}  // namespace
}  // namespace selfcal::import
