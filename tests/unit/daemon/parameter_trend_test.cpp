#include "daemon/store/parameter_trend.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace selfcal {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

ParameterRecord value(int year, double figure, double sigma = 1.0) {
  return {1, fmt::format("{}-01-01T00:00:00Z", year), figure, sigma, true};
}

TEST(ParameterTrend, ALineIsFoundExactly) {
  const auto trend = parameter_trend({value(2020, 10), value(2021, 12), value(2022, 14), value(2023, 16)});
  ASSERT_TRUE(trend);
  // Years differ by up to a day from 365.2425 days: 2 a year, times 1/365.
  EXPECT_NEAR(trend->slope_per_year, 2.0, 2.0 / 365);
  EXPECT_EQ(trend->ageing, 0.0);
  EXPECT_NEAR(trend->at(year_of("2024-01-01T00:00:00Z")), 18.0, 0.05);
}

TEST(ParameterTrend, ScatterBeyondSigmaIsTakenAsAgeing) {
  // +-10 about a level, sigma 0.1: ageing must be of the size of the scatter.
  const auto trend =
      parameter_trend({value(2020, 10, 0.1), value(2021, -10, 0.1), value(2022, 10, 0.1), value(2023, -10, 0.1)});
  ASSERT_TRUE(trend);
  EXPECT_GT(trend->ageing, 8.0);
  EXPECT_LT(trend->ageing, 20.0);
}

TEST(ParameterTrend, OneValueHasNoTrendAndUndeterminedOnesDoNotCount) {
  EXPECT_FALSE(parameter_trend({value(2020, 10)}));
  ParameterRecord vague = value(2021, 50);
  vague.determined = false;
  EXPECT_FALSE(parameter_trend({value(2020, 10), vague}));
}

// Three runs of one morning scatter about a level; a slope a year of them is noise times thousands.
TEST(ParameterTrend, RunsMinutesApartHaveNoSlope) {
  std::vector<ParameterRecord> morning;
  for (const auto& [minute, figure] : {std::pair{0, 10.0}, {40, 11.0}, {80, 12.0}}) {
    morning.push_back({1, fmt::format("2026-01-01T{:02}:{:02}:00Z", 8 + minute / 60, minute % 60), figure, 1.0, true});
  }
  const auto trend = parameter_trend(morning);
  ASSERT_TRUE(trend);
  EXPECT_EQ(trend->slope_per_year, 0.0);
  EXPECT_EQ(trend->slope_sigma, 0.0);
  // Sigma 1 each, the scatter within it: the mean of three.
  EXPECT_NEAR(trend->at(year_of("2027-01-01T00:00:00Z")), 11.0, 1e-9);
}

TEST(TrendWarnings, AValueThatFitsIsNotMentionedAndOneThatDoesNotIs) {
  const std::vector<ParameterRecord> past{value(2020, 10), value(2021, 10.5), value(2022, 9.5)};
  EXPECT_THAT(trend_warnings("accel_bias_x", "ug", past, value(2023, 11), 0), IsEmpty());
  const auto warnings = trend_warnings("accel_bias_x", "ug", past, value(2023, 60), 0);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("accel_bias_x 60 ug departs from this unit's past"));
}

TEST(TrendWarnings, ALimitIsWarnedOfNearItAndAhead) {
  const std::vector<ParameterRecord> past{value(2020, 10), value(2021, 20), value(2022, 30)};
  const auto ahead = trend_warnings("gyro_drift_z", "deg/h", past, value(2023, 40), 100);
  ASSERT_EQ(ahead.size(), 1u);
  EXPECT_THAT(ahead[0], HasSubstr("reaches its limit of 100 in 6.0 years"));
  const auto near = trend_warnings("gyro_drift_z", "deg/h", {}, value(2023, 90), 100);
  ASSERT_EQ(near.size(), 1u);
  EXPECT_THAT(near[0], HasSubstr("is near its limit"));
  // What lies far beyond is not near: "795.6 ug is near its limit of 100".
  const auto beyond = trend_warnings("accel_bias_x", "ug", {}, value(2023, 795.6), 100);
  EXPECT_THAT(beyond, testing::ElementsAre("accel_bias_x 795.6 ug is beyond its limit of 100"));
}

}  // namespace
}  // namespace selfcal
