// Spectra of a recording made up here: white noise, a count, a line, and a base that tilts.
#include "estimator/diagnosis/noise/noise_spectra.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/diagnosis/parked_recording.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 20.0, g = 9.8, white = 2e-6, count = 1e-5, line = 3e-4, line_hz = 3.0;

struct Parked : ParkedRecording {
  std::vector<double> tilt;

  std::vector<Segment> dwell() const { return {{false, 0, time_s.size(), 0.0, time_s.back(), 0.0, 0.0}}; }
};

// y up: a turn about x takes gravity towards -z. About x the base tilts by a Gauss-Markov process, passed twice, of tau_s: wind, with a
// shape of its own. What stands above_m over the axis is moved against the tilt's gravity.
Parked parked(unsigned seed, double above_m = 0.0, double tau_s = 60.0) {
  Parked p;
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  const std::size_t n = 36000;
  double pushed = 0.0, whole = 0.0, counted = 0.0;
  std::vector<double> tilt(n + 6, 0.0);
  for (std::size_t i = 1; i < tilt.size(); ++i) {
    pushed += (-pushed / tau_s + 1e-4 * normal(engine) * std::sqrt(rate_hz)) / rate_hz;
    tilt[i] = tilt[i - 1] + (pushed - tilt[i - 1]) / tau_s / rate_hz;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i + 1) / rate_hz, before = tilt[i + 2], now = tilt[i + 3];
    const auto middle = [&](std::size_t k) { return 0.5 * (tilt[k] + tilt[k + 1]); };  // of sample k - 2
    // Of fourth order: 0.2 % too small at 2 Hz.
    const double bent = (16.0 * (middle(i + 1) + middle(i + 3)) - middle(i) - middle(i + 4) - 30.0 * middle(i + 2)) /
                        12.0 * rate_hz * rate_hz;
    whole += 5.0 * count * normal(engine);
    const double counts = count * std::round(whole / count);
    const double sigma = white * std::sqrt(0.5 / rate_hz);  // of an increment: density is one-sided
    p.time_s.push_back(t);
    p.tilt.push_back(now);
    p.delta_theta.push_back({now - before + sigma * normal(engine), sigma * normal(engine), counts - counted});
    counted = counts;
    p.delta_v.push_back({1e-5 * normal(engine), (g + line * std::sin(2.0 * std::numbers::pi * line_hz * t)) / rate_hz,
                         (above_m * bent - g * 0.5 * (now + before)) / rate_hz + 1e-7 * normal(engine)});
  }
  return p;
}

double power(const DensityTable& table, double low_hz, double high_hz) {
  double sum = 0.0;
  for (std::size_t k = 0; k < table.density.size(); ++k) {
    const double width = std::min(high_hz, table.edges_hz[k + 1]) - std::max(low_hz, table.edges_hz[k]);
    sum += std::max(0.0, width) * table.density[k] * table.density[k];
  }
  return sum;
}

TEST(NoiseSpectra, HoldEachNoiseInItsPlace) {
  const Parked p = parked(3);
  const auto spectra = noise_spectra(p.data(), p.dwell(), 0.0, 0.0);
  ASSERT_TRUE(spectra);
  // White: 8 Hz of pieces of 25.6 s and 1800 s, 14,400 periods: 1 % of the square, and a taper's loss.
  EXPECT_NEAR(power(spectra->sensors[1], 1.0, 9.0) / (8.0 * white * white), 1.0, 0.05);
  // All of white noise is a few bands.
  EXPECT_LT(spectra->sensors[1].density.size(), 60U);
  EXPECT_NEAR(power(spectra->sensors[4], line_hz - 0.2, line_hz + 0.2) / (0.5 * line * line), 1.0, 0.02);
  EXPECT_LT(power(spectra->sensors[4], 4.0, 10.0), 1e-4 * line * line);
}

TEST(NoiseSpectra, WhatBothTriadsFeelIsTilt) {
  const Parked p = parked(4);
  const auto spectra = noise_spectra(p.data(), p.dwell(), 0.0, 0.0);
  ASSERT_TRUE(spectra);
  ASSERT_FALSE(spectra->roll.table.density.empty());
  double mean = 0.0, square = 0.0;
  for (const double tilt : p.tilt) {
    mean += tilt / static_cast<double>(p.tilt.size());
  }
  for (const double tilt : p.tilt) {
    square += (tilt - mean) * (tilt - mean) / static_cast<double>(p.tilt.size());
  }
  // A Hann window over 1800 s of a process of 120 s sees a part of it: some 20 independent stretches, 22 % of its mean power each way.
  EXPECT_NEAR(power(spectra->roll.table, 0.0, 1.0) / square, 1.0, 0.7);
  // And what is left for the sensors there is a small part of it.
  EXPECT_LT(power(spectra->sensors[5], 0.0, 0.01), 0.1 * g * g * power(spectra->roll.table, 0.0, 0.01));
  // Nothing tilts about z.
  EXPECT_LT(power(spectra->pitch.table, 0.0, 1.0), 1e-3 * power(spectra->roll.table, 0.0, 1.0));
}

// A sensor mounted 2 and 1 deg off level: of the tilt its other axes feel 3 %, and of the noise about the vertical its level ones. What one
// triad's axis has of another's motion is not its own noise.
TEST(NoiseSpectra, ALeaningBaseLeavesNoTiltToTheSensors) {
  Parked p = parked(4);
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.035, Vector3::UnitZ()) * Eigen::AngleAxisd(0.017, Vector3::UnitX())).toRotationMatrix();
  for (std::size_t i = 0; i < p.time_s.size(); ++i) {
    Eigen::Map<Vector3>(p.delta_theta[i].data()) = turn * Vector3(p.delta_theta[i].data());
    Eigen::Map<Vector3>(p.delta_v[i].data()) = turn * Vector3(p.delta_v[i].data());
  }
  const auto spectra = noise_spectra(p.data(), p.dwell(), 0.0, 0.0);
  ASSERT_TRUE(spectra);
  const double tilt = g * g * power(spectra->roll.table, 0.0, 0.01);
  ASSERT_GT(tilt, 0.0);
  // x feels cos(roll) sin(pitch) of it, 1.2e-3 of the power; a thousandth of that is left.
  for (const std::size_t sensor : {3U, 4U}) {
    EXPECT_LT(power(spectra->sensors[sensor], 0.0, 0.01), 1e-5 * tilt);
  }
}

// At 1 Hz the force of a base that turns 2 m below is 1 + 39.5 * 2 / 9.8 = 9 times g and the angle.
TEST(NoiseSpectra, ForceGrowsWithTheFrequencyAboveTheAxis) {
  for (const double above_m : {2.0, -0.5}) {
    const Parked p = parked(7, above_m, 5.0);
    const auto spectra = noise_spectra(p.data(), p.dwell(), 0.0, 0.0);
    ASSERT_TRUE(spectra);
    // Bins count up to where a tenth of the force is something else: by so much noise of the angle may make the gain too small.
    ASSERT_EQ(spectra->roll.above_m.size(), spectra->roll.table.density.size());
    for (const double told : spectra->roll.above_m) {
      // Each is taken where what noise may make of it are within a quarter, and its sigma is below 0.2 m.
      EXPECT_NEAR(told, above_m, 0.25 * std::abs(above_m) + 0.4);
    }
  }
}

// Two springs: about an axis half a metre below up to 0.5 Hz, 2 m below above. Sines every 0.01 Hz from 0.01 to 1.5 Hz, of 100 urad over their
// frequency in hundredths; the force of the tilt is 1 + w^2 h/g times g and the angle.
TEST(NoiseSpectra, TheAxisIsAnotherAtEachFrequency) {
  Parked p = parked(9);
  std::mt19937 engine(9);
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  for (int k = 1; k <= 150; ++k) {
    const double hz = 0.01 * k, w = 2.0 * std::numbers::pi * hz, start = phase(engine), size = 1e-4 / k;
    const double force = size * (g + w * w * (hz < 0.5 ? 0.5 : 2.0));
    for (std::size_t i = 0; i < p.time_s.size(); ++i) {
      const double before = w * static_cast<double>(i) / rate_hz + start, now = before + w / rate_hz;
      p.delta_theta[i][0] += size * (std::sin(now) - std::sin(before));
      p.delta_v[i][2] += force * (std::cos(now) - std::cos(before)) / w;  // less its integral
    }
  }
  const auto spectra = noise_spectra(p.data(), p.dwell(), 0.0, 0.0);
  ASSERT_TRUE(spectra);
  const DensityTable& table = spectra->roll.table;
  ASSERT_FALSE(table.density.empty());
  EXPECT_GT(table.edges_hz.back(), 1.0);
  int low = 0, high = 0;
  for (std::size_t k = 0; k < table.density.size(); ++k) {
    const double middle_hz = 0.5 * (table.edges_hz[k] + table.edges_hz[k + 1]);
    if (middle_hz < 0.45) {
      EXPECT_NEAR(spectra->roll.above_m[k], 0.5, 0.2) << middle_hz;
      ++low;
    } else if (middle_hz > 0.55 && middle_hz < 1.45) {
      EXPECT_NEAR(spectra->roll.above_m[k], 2.0, 0.1) << middle_hz;
      ++high;
    }
  }
  EXPECT_GT(low, 1);
  EXPECT_GT(high, 1);
}

// Tilt of minutes is hidden by the gyros' noise long before its acceleration shows: no axis is stated.
TEST(NoiseSpectra, AnAxisThatDoesNotShowIsNotStated) {
  const Parked p = parked(7, 2.0, 60.0);
  const auto spectra = noise_spectra(p.data(), p.dwell(), 0.0, 0.0);
  ASSERT_TRUE(spectra);
  ASSERT_FALSE(spectra->roll.table.density.empty());
  for (const double above_m : spectra->roll.above_m) {
    EXPECT_EQ(above_m, 0.0);
  }
}

TEST(NoiseSpectra, LeaveTheCountToWhoCounts) {
  const Parked p = parked(5);
  const auto with = noise_spectra(p.data(), p.dwell(), 0.0, 0.0),
             without = noise_spectra(p.data(), p.dwell(), count, 0.0);
  ASSERT_TRUE(with && without);
  // White noise of 5 counts a sample and the count's own: at 9 to 10 Hz 25 and 4/12 of count^2.
  const double whole = power(with->sensors[2], 9.0, 10.0), left = power(without->sensors[2], 9.0, 10.0);
  EXPECT_NEAR((whole - left) / whole, (4.0 / 12.0) / (25.0 + 4.0 / 12.0), 0.003);
  EXPECT_NEAR(left / (2.0 * 25.0 * count * count * rate_hz), 1.0, 0.15);
}

TEST(NoiseSpectra, NeedADwell) {
  Parked p = parked(6);
  const std::vector<Segment> all_turning = {{true, 0, p.time_s.size(), 0.0, p.time_s.back(), 0.0, 0.0}};
  EXPECT_FALSE(noise_spectra(p.data(), all_turning, 0.0, 0.0));
}

}  // namespace
}  // namespace selfcal::diagnosis
