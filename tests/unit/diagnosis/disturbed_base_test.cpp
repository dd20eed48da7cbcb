// A base that people shake, and accelerometers that lose a count: noise that follows the loudness, and jumps of the velocity, in
// recordings that are made here.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/diagnosis/noise/loudness.hpp"
#include "estimator/diagnosis/noise/velocity_jumps.hpp"
#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "tests/unit/diagnosis/quantised_noise.hpp"

namespace selfcal::diagnosis {
namespace {

const quantised_noise::Axes quiet{{0.001, 0.001, 0.001}, {2.0, 2.0, 2.0}, {30.0, 30.0, 30.0}};

// A recording with its calibration and the filter's noise fitted.
struct Fitted {
  ImuData data;
  CalibrationOutcome calibration;
  std::vector<Segment> segments;
  PassInput input;
  bool fitted = false;

  explicit Fitted(const Recording& recording)
      : data(test::view_of(recording)), calibration(calibrate_still(data, {}, {})), segments(find_segments(data)) {
    if (calibration.result) {
      input = forward_pass(data, *calibration.result);
      fitted = fit_velocity_noise(input, check_noise(data, segments), segments);
    }
  }
};

// Mean square of the innovations over what was predicted, where `counts` of the middle of the interval.
template <typename Counts>
double nis_where(const PassInput& input, Counts counts) {
  double sum = 0.0;
  int n = 0;
  for (const Epoch& e : run_pass(input).epochs) {
    if (counts(e.interval_middle_s)) {
      sum += e.innovation.cwiseAbs2().cwiseQuotient(e.variance).mean();
      ++n;
    }
  }
  return sum / n;
}

// 20 s of every 100, turns among them.
bool loud(double t) { return std::fmod(t, 100.0) >= 70.0 && std::fmod(t, 100.0) < 90.0; }

// Rocking about two axes at 1.7 Hz; angles come back, so that the attitude is what it was.
void rock(Recording& r, double amplitude) {
  const auto angle = [&](double t) {
    return loud(t) ? amplitude * std::sin(2.0 * std::numbers::pi * 1.7 * std::fmod(t, 100.0)) : 0.0;
  };
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const double change = angle(r.time_s[i]) - angle(r.time_s[i] - 1.0 / quantised_noise::rate_hz);
    r.delta_theta_rad[i][0] += change;
    r.delta_theta_rad[i][2] += change;
  }
}

TEST(DisturbedBase, NoiseFollowsTheLoudness) {
  constexpr double times = 6.0;
  Recording recording = quantised_noise::recording_with(quiet, [](double t) { return loud(t) ? times : 1.0; });
  rock(recording, 2e-5);
  const Fitted f(recording);
  ASSERT_TRUE(f.fitted);
  ASSERT_FALSE(f.input.noise.shaken.empty());
  // 900 quiet seconds of three axes fix a variance to 2.7 %, 230 loud ones to 5.4 %: four times that. One density for both would give 0.13 and 4.6.
  EXPECT_NEAR(nis_where(f.input, [](double t) { return !loud(t); }), 1.0, 0.11);
  EXPECT_NEAR(nis_where(f.input, loud), 1.0, 0.22);
}

TEST(DisturbedBase, QuietBaseHasOneDensity) {
  const Recording recording = quantised_noise::recording_with(quiet);
  const Fitted f(recording);
  ASSERT_TRUE(f.fitted);
  EXPECT_TRUE(f.input.noise.shaken.empty());
  EXPECT_FALSE(changes_its_loudness(loudness_of(f.data, f.segments, 1.0)));
}

void jump(Recording& r, double t, std::size_t axis, double size) {
  r.delta_v_mps[static_cast<std::size_t>(t * quantised_noise::rate_hz)][axis] += size;
}

TEST(DisturbedBase, LostCountsAreFoundWithTimeAndSize) {
  constexpr double count = 1.2e-3;
  Recording recording = quantised_noise::recording_with(quiet);
  const std::array<double, 3> when = {100.3, 359.6, 725.5};  // in dwells, 37, 44 and 32 s behind a turn
  jump(recording, when[0], 1, count);
  jump(recording, when[1], 0, -count);
  jump(recording, when[2], 2, count);
  Fitted f(recording);
  ASSERT_TRUE(f.fitted);
  const std::vector<VelocityJump> found = open_velocity_jumps(f.input, f.segments);
  ASSERT_EQ(found.size(), 3U);
  const std::array<Vector3, 3> size = {Vector3(0, count, 0), Vector3(-count, 0, 0), Vector3(0, 0, count)};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_LE(found[k].start_s, when[k]);
    EXPECT_GE(found[k].end_s, when[k]);
    // Where in its second a jump stands is not known: +-0.5 s of it are 0.6 mm of the position, which the next seconds tell. Four sigma.
    EXPECT_TRUE(((found[k].size_b - size[k]).cwiseAbs().array() < 4.0 * found[k].sigma_b.array() + 0.1 * count).all())
        << found[k].size_b.transpose();
  }
}

TEST(DisturbedBase, WhatStandsInTurnsAloneIsNoJump) {
  Recording recording = quantised_noise::recording_with(quiet);
  for (int turn = 0; turn < 18; ++turn) {
    jump(recording, 63.0 * (turn + 1) - 2.5, 1, 1.2e-3);
  }
  Fitted f(recording);
  ASSERT_TRUE(f.fitted);
  EXPECT_TRUE(open_velocity_jumps(f.input, f.segments).empty());
}

// Who gets in while the gimbal turns knocks six times within 16 s. Counted one by one six would be too many beside two lost counts
// (negative binomial: five or more come in 3 % of recordings), and four would be believed.
TEST(DisturbedBase, KnocksOfOneDisturbanceCountOnce) {
  constexpr double size = 2.4e-3, turn_s = 625.0;
  Recording recording = quantised_noise::recording_with(quiet);
  jump(recording, 100.3, 1, size);
  jump(recording, 359.6, 0, size);
  for (std::size_t knock = 0; knock < 6; ++knock) {
    jump(recording, turn_s + 3.0 * static_cast<double>(knock) + 0.5, knock % 3, knock % 2 == 0 ? size : -size);
  }
  Fitted f(recording);
  ASSERT_TRUE(f.fitted);
  const std::vector<VelocityJump> found = open_velocity_jumps(f.input, f.segments);
  for (std::size_t knock = 0; knock < 6; ++knock) {
    const double when = turn_s + 3.0 * static_cast<double>(knock) + 0.5;
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const VelocityJump& j) {
      return j.start_s <= when && j.end_s >= when;
    })) << when;
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
