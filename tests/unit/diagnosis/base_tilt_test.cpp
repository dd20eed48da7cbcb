// A base that tilts, or a gyro that drifts: made up here, 20 Hz, 20 minutes.
#include "estimator/diagnosis/noise/base_tilt.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/diagnosis/parked_recording.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 20.0, g = 9.8, duration_s = 1200.0, amplitude = 1e-3, period_s = 700.0;

// y up; about x by a sine. `felt`: by the accelerometers too.
ParkedRecording tilting(bool felt) {
  ParkedRecording data;
  std::mt19937 engine(3);
  std::normal_distribution<double> normal;
  double before = 0.0;
  for (double t = 1.0 / rate_hz; t < duration_s; t += 1.0 / rate_hz) {
    const double angle = amplitude * std::sin(2.0 * std::numbers::pi * t / period_s);
    data.time_s.push_back(t);
    data.delta_theta.push_back({angle - before + 1e-6 + 1e-7 * normal(engine), 0.0, 0.0});
    data.delta_v.push_back({0.0, g / rate_hz, ((felt ? -g * angle : 0.0) + 1e-3 * normal(engine)) / rate_hz});
    before = angle;
  }
  return data;
}

std::vector<Segment> dwell(const ImuData& data) { return {{false, 0, data.size(), 0.0, duration_s, 0.0, 0.0}}; }

TEST(BaseTilt, WhatGravityAndGyrosShowAlikeIsMotion) {
  const ParkedRecording parked = tilting(true);
  const ImuData data = parked.data();
  const auto tilt = base_tilt(data, dwell(data));
  ASSERT_TRUE(tilt);
  EXPECT_NEAR(tilt->range, 2.0 * amplitude, 0.02 * amplitude);  // noise of a mean: 1e-3 / 9.8 / sqrt(200) = 7e-6
  EXPECT_GT(tilt->correlation, 0.99);
  EXPECT_LT(tilt->apart, 0.05 * amplitude);
}

TEST(BaseTilt, AGyroThatDriftsTiltsNoBase) {
  const ParkedRecording parked = tilting(false);
  const ImuData data = parked.data();
  EXPECT_FALSE(base_tilt(data, dwell(data)));
}

}  // namespace
}  // namespace selfcal::diagnosis
