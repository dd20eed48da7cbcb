// Which three columns without names are accelerometers.
#include <gtest/gtest.h>

#include <cmath>

#include "protocol/import/gravity_columns.hpp"

namespace selfcal::import {
namespace {

constexpr int rows = 400;

// A little noise about a level, another one in each column.
std::vector<double> column(double level, double noise) {
  static int seed = 0;
  ++seed;
  std::vector<double> values;
  for (int k = 0; k < rows; ++k) {
    values.push_back(level + noise * std::sin(1.7 * k * seed + 0.3 * k * k));
  }
  return values;
}

std::vector<Triad> all_triads(std::size_t columns) {
  std::vector<Triad> all;
  for (std::size_t k = 0; k + 2 < columns; ++k) {
    all.push_back({k, k + 1, k + 2});
  }
  return all;
}

GravityColumns found_in(const Values& values, const std::vector<double>& intervals_s = {}) {
  return gravity_columns(values, all_triads(values.size()), 2, intervals_s).value();
}

TEST(GravityColumns, AtRestTheThreeOfGravitysSizeBesideWhichThreeAreLeft) {
  const Values values{column(-4.5, 0.05),  column(0.8, 0.02),   column(-8.68, 0.05),
                      column(0.01, 0.001), column(0.02, 0.001), column(0.01, 0.001)};
  const GravityColumns found = found_in(values);
  EXPECT_EQ(found.triad, (Triad{0, 1, 2}));
  EXPECT_EQ(found.alike, 1U);
  EXPECT_EQ(found.words.substr(found.words.find(',')), ", gravity's in m/s^2");
  EXPECT_FALSE(found.moves);
}

TEST(GravityColumns, IncrementsByTheInterval) {
  const Values values{column(4e-4, 1e-5),   column(1e-4, 1e-5),  column(-1e-5, 1e-5),
                      column(-0.019, 1e-4), column(-2e-4, 1e-4), column(0.0452, 2e-4)};
  EXPECT_EQ(found_in(values, {0.005}).triad, (Triad{3, 4, 5}));
  EXPECT_EQ(found_in(values, {0.005}).alike, 1U);
  EXPECT_GT(found_in(values).alike, 1U);
}

// "3, ax, ay, az, 4, gx, gy, gz": numbers of the sensors between their readings.
TEST(GravityColumns, NoNumbersThatStandStill) {
  const Values values{column(3.0, 0.0), column(-0.04, 0.002), column(-0.1, 0.005), column(9.74, 0.006),
                      column(4.0, 0.0), column(0.0, 0.001),   column(0.0, 0.001),  column(0.0, 0.001)};
  const GravityColumns found = found_in(values);
  EXPECT_EQ(found.triad, (Triad{1, 2, 3}));
  EXPECT_EQ(found.alike, 1U);
}

// Of an orientation and a rate: 0.9 and two that rise and fall.
TEST(GravityColumns, ALargeOneBesideTwoThatRiseAndFallIsNoRest) {
  Values values{column(0.5, 0.4), column(-0.5, 0.4), column(0.5, 0.4),  column(0.0, 0.5),
                column(0.0, 0.0), column(0.0, 0.0),  column(0.93, 1e-3)};
  for (int k = 0; k < rows; ++k) {
    values[4][static_cast<std::size_t>(k)] = 0.2 * std::sin(0.05 * k);
    values[5][static_cast<std::size_t>(k)] = 0.2 * std::cos(0.05 * k);
  }
  const GravityColumns found = found_in(values);
  EXPECT_EQ(found.triad, (Triad{4, 5, 6}));
  EXPECT_TRUE(found.moves);
}

// Counts beside a magnetometer of length one: neither is silently taken.
TEST(GravityColumns, AnotherSetElsewhereStaysADoubt) {
  const Values values{column(120.0, 5.0), column(-80.0, 5.0), column(16300.0, 20.0), column(1.0, 1.0), column(2.0, 1.0),
                      column(1.0, 1.0),   column(0.6, 1e-3),  column(0.0, 1e-3),     column(0.8, 1e-3)};
  EXPECT_GT(found_in(values).alike, 1U);
}

}  // namespace
}  // namespace selfcal::import
