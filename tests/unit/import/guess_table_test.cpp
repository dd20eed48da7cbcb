// A log of a table with one axis: what the guess makes of the column of its angles. Truth by hand: stops of 6 s, turns of 3 s by 30 deg.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "protocol/import/guess.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double rate_hz = 50.0, step = 30.0, stop_s = 6.0, turn_s = 3.0;

// deg, t seconds after the start; the turn a raised cosine.
double table_angle(double t) {
  const double cycle = stop_s + turn_s, turn = std::floor(t / cycle), inside = t - turn * cycle - stop_s;
  const double part = inside < 0.0 ? 0.0 : 0.5 * (1.0 - std::cos(std::numbers::pi * inside / turn_s));
  return step * (turn + part);
}

struct Log {
  std::string angle_name = "table_angle_deg";
  double gyro_sign = 1.0;  // of z
  double delay_s = 0.0;    // of the read-out
  bool follows = true;     // else the angle does something else
  bool with_angle = true;
  bool with_rate = false;  // the table's own, beside its angle
  double restart_s = 0.0;  // the logger's time begins anew then; 0: never
};

class GuessTable : public ::testing::Test {
 protected:
  // Rates in deg/s with a bias and 0.02 deg/s of noise, z along the vertical axis of the table; accelerometers at rest.
  Guess guess_of(const Log& log) {
    std::mt19937 engine(7);
    std::normal_distribution<double> normal;
    std::string text = "time_s,gx_dps,gy_dps,gz_dps,ax_mps2,ay_mps2,az_mps2";
    text += (log.with_rate ? ",table_rate_dps" : "") + (log.with_angle ? "," + log.angle_name + "\n" : "\n");
    const int samples = static_cast<int>(12.0 * (stop_s + turn_s) * rate_hz);
    for (int k = 1; k <= samples; ++k) {
      const double t = k / rate_hz, dt = 1.0 / rate_hz;
      const double rate = log.gyro_sign * (table_angle(t) - table_angle(t - dt)) / dt;
      text += fmt::format("{:.2f}", log.restart_s > 0.0 && t > log.restart_s ? t - log.restart_s : t);
      for (const double value : {0.1, -0.2, rate + 0.05}) {
        text += fmt::format(",{:.6f}", value + 0.02 * normal(engine));
      }
      for (const double value : {0.01, 0.02, 9.807}) {
        text += fmt::format(",{:.6f}", value + 0.003 * normal(engine));
      }
      text += log.with_rate ? fmt::format(",{:.4f}", rate) : "";
      const double angle = log.follows ? table_angle(std::max(0.0, t - log.delay_s)) : 40.0 * std::sin(t);
      text += log.with_angle ? fmt::format(",{:.5f}\n", std::fmod(angle, 360.0)) : "\n";
    }
    std::ofstream(file_) << text;
    const auto source = open_columns(file_);
    EXPECT_TRUE(source);
    auto guess = guess_map(**source, {}, "file.txt");
    EXPECT_TRUE(guess);
    return *guess;
  }
  static std::string said(const Guess& guess, const std::string& key, bool doubt) {
    std::string all;
    for (const Remark& r : guess.remarks) {
      all += r.key == key && r.doubt == doubt ? r.text + "\n" : "";
    }
    return all;
  }
  const test::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "file.txt";
};

TEST_F(GuessTable, OneAngleThatTheGyrosFollowIsItsReadOut) {
  const Guess guess = guess_of({});
  ASSERT_TRUE(guess.map.gimbal.outer);
  EXPECT_EQ(guess.map.gimbal.outer->name, "table_angle_deg");
  EXPECT_FALSE(guess.map.gimbal.inner);
  EXPECT_FALSE(guess.map.gimbal.fixed_deg);
  EXPECT_EQ(guess.map.gimbal.unit, "deg");
  EXPECT_EQ(guess.map.gimbal.signs[0], 1.0);
  EXPECT_EQ(guess.map.gyro.unit, "deg/s");
  EXPECT_THAT(said(guess, "gyro.unit", false), HasSubstr("the turns show it"));  // no turn of gravity does
  EXPECT_THAT(said(guess, "gimbal.outer", false), HasSubstr("in 11 turns, mostly about z"));
  EXPECT_THAT(guess.map.unsettled, Not(Contains("gimbal")));
  EXPECT_THAT(guess.map.unsettled, Contains("gyro.axes"));  // gravity does not turn: order and signs stay open
}

// Sums from rest to rest do not feel a second of delay, and the sign is the gyro's.
TEST_F(GuessTable, LateAndReversed) {
  const Guess guess = guess_of({.gyro_sign = -1.0, .delay_s = 1.0});
  ASSERT_TRUE(guess.map.gimbal.outer);
  EXPECT_EQ(guess.map.gimbal.signs[0], -1.0);
  EXPECT_THAT(guess.map.unsettled, Not(Contains("gimbal")));
}

TEST_F(GuessTable, ATablesRateBesideItsAngleIsNoSecondAngle) {
  const Guess guess = guess_of({.with_rate = true});
  ASSERT_TRUE(guess.map.gimbal.outer);
  EXPECT_EQ(guess.map.gimbal.outer->name, "table_angle_deg");
  EXPECT_THAT(guess.map.unsettled, Not(Contains("gimbal")));
}

TEST_F(GuessTable, ATablesRateAloneIsAddedUp) {
  const Guess guess = guess_of({.with_angle = false, .with_rate = true});
  ASSERT_TRUE(guess.map.gimbal.outer);
  EXPECT_EQ(guess.map.gimbal.outer->name, "table_rate_dps");
  EXPECT_EQ(guess.map.gimbal.unit, "deg/s");
  EXPECT_THAT(said(guess, "gimbal.outer", false),
              HasSubstr("column 8 (table_rate_dps), the rate, added up, of a table"));
  EXPECT_THAT(guess.map.unsettled, Not(Contains("gimbal")));
}

TEST_F(GuessTable, WhereATimeBeginsAnewIsSaid) {
  const Guess guess = guess_of({.restart_s = 40.0});
  EXPECT_THAT(said(guess, "time.column", true),
              HasSubstr("in 1 place, first from 40 to 0.02 at row 2001 of the numbers"));
}

TEST_F(GuessTable, WhatTheGyrosDoNotFollowIsDoubted) {
  const Guess guess = guess_of({.follows = false});
  EXPECT_FALSE(guess.map.gimbal.outer);
  EXPECT_THAT(said(guess, "gimbal", true), HasSubstr("angles by the name, but they explain"));
  EXPECT_THAT(guess.map.unsettled, Contains("gimbal"));
}

// A yaw may be what somebody integrated from the same gyros: it proves nothing about them.
TEST_F(GuessTable, AnAttitudeIsDoubted) {
  const Guess guess = guess_of({.angle_name = "yaw_deg"});
  EXPECT_TRUE(guess.map.gimbal.outer);
  EXPECT_THAT(said(guess, "gimbal", true), HasSubstr("computed from these gyros"));
  EXPECT_THAT(guess.map.unsettled, Contains("gimbal"));
}

// Rates in deg/s under a read-out in rad would be wrong by 57: the names' own unit says which it is.
TEST_F(GuessTable, AUnitThatTheNameDoesNotSayFollowsFromTheGyros) {
  const Guess guess = guess_of({.angle_name = "encoder"});
  ASSERT_TRUE(guess.map.gimbal.outer);
  EXPECT_EQ(guess.map.gimbal.unit, "deg");
  EXPECT_THAT(guess.map.unsettled, Not(Contains("gimbal.unit")));
}

TEST_F(GuessTable, WhatTurnsAboutTheVerticalIsNotCalledStill) {
  const Guess guess = guess_of({.with_angle = false});
  EXPECT_TRUE(guess.map.gimbal.fixed_deg);
  EXPECT_THAT(said(guess, "gimbal", false), Not(HasSubstr("nothing turns")));
  EXPECT_THAT(said(guess, "gimbal", true), HasSubstr("turned about the vertical"));
}

}  // namespace
}  // namespace selfcal::import
