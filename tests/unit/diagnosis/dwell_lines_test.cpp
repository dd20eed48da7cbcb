#include "estimator/diagnosis/noise/dwell_lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 64.0, length_s = 60.0;
constexpr double integral_noise = 2e-4;  // m/s, white: a quantum of 0.7 mm/s
constexpr double bias = 1e-3, frequency_hz = 0.4;

// One dwell of accelerometer z: a bias, white noise of velocity and a line of force.
struct Dwell {
  std::vector<double> time;
  AngleVelocity theta, velocity;
  ImuData data;
  std::vector<Segment> segments;

  explicit Dwell(double amplitude, double until_s = length_s) {
    const auto n = static_cast<std::size_t>(rate_hz * length_s);
    std::mt19937_64 engine(5);
    std::normal_distribution<double> normal(0.0, integral_noise);
    theta.assign(n, {0.0, 0.0, 0.0});
    double last = normal(engine);
    for (std::size_t i = 0; i < n; ++i) {
      const double t = static_cast<double>(i) / rate_hz;
      const double now = normal(engine);
      const double line = t < until_s ? amplitude : 0.0;
      const double force = bias + line * std::cos(2.0 * std::numbers::pi * frequency_hz * t);
      velocity.push_back({0.0, 0.0, force / rate_hz + now - last});
      last = now;
      time.push_back(t + 1.0 / rate_hz);
    }
    data.sample_rate_hz = rate_hz;
    data.time_s = time;
    data.delta_theta = theta;
    data.delta_v = velocity;
    segments = {{false, 0, n, 0.0, length_s, 0.0, 0.0}};
  }
};

// Amplitude at a frequency of what is left, m/s^2.
double amplitude_of(const AngleVelocity& velocity) {
  double cosine = 0.0, sine = 0.0;
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const double phase = 2.0 * std::numbers::pi * frequency_hz * static_cast<double>(i) / rate_hz;
    cosine += (velocity[i][2] * rate_hz - bias) * std::cos(phase);
    sine += (velocity[i][2] * rate_hz - bias) * std::sin(phase);
  }
  return std::hypot(cosine, sine) * 2.0 / static_cast<double>(velocity.size());
}

// White noise s of the integral has the two-sided density s^2 (2 pi f)^2 / rate; an amplitude fitted over T scatters by
// sqrt(2 density / T), 1.1e-5 m/s^2 here.
const double amplitude_sigma =
    2.0 * std::numbers::pi * frequency_hz * integral_noise * std::sqrt(2.0 / (rate_hz * length_s));

TEST(DwellLines, StrongLineIsFoundAndTakenOut) {
  const double amplitude = 50.0 * amplitude_sigma;
  Dwell dwell(amplitude);
  const auto lines = subtract_dwell_lines(dwell.data, dwell.segments, {}, dwell.theta, dwell.velocity);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines.front().axis, 5);
  // Between two bins of 1/60 Hz the peak is found to a tenth of one: the amplitude loses (pi/10)^2/6 = 1.6 %.
  EXPECT_NEAR(lines.front().frequency_hz, frequency_hz, 0.1 / length_s);
  EXPECT_NEAR(lines.front().amplitude, amplitude, 5.0 * amplitude_sigma + 0.016 * amplitude);
  // What a tenth of a bin leaves: pi/10/sqrt(3) of it in quadrature.
  EXPECT_LT(amplitude_of(dwell.velocity), 0.18 * amplitude + 5.0 * amplitude_sigma);
}

// Whole periods have no mean, so the bias stays.
TEST(DwellLines, BiasStays) {
  Dwell dwell(50.0 * amplitude_sigma);
  double before = 0.0, after = 0.0;
  for (const auto& v : dwell.velocity) {
    before += v[2] / length_s;
  }
  subtract_dwell_lines(dwell.data, dwell.segments, {}, dwell.theta, dwell.velocity);
  for (const auto& v : dwell.velocity) {
    after += v[2] / length_s;
  }
  // A tenth of a bin off, the sinusoid's mean over the dwell is at most a/(2 pi f T) of its amplitude.
  EXPECT_NEAR(after, before, 50.0 * amplitude_sigma / (2.0 * std::numbers::pi * frequency_hz * length_s));
}

// A base that rocks for a third of the dwell has a peak too; a sine of the whole dwell in its place would be put into the other two thirds.
TEST(DwellLines, WhatEndsWithinTheDwellIsNoLine) {
  Dwell dwell(150.0 * amplitude_sigma, length_s / 3.0);
  const AngleVelocity before = dwell.velocity;
  EXPECT_TRUE(subtract_dwell_lines(dwell.data, dwell.segments, {}, dwell.theta, dwell.velocity).empty());
  EXPECT_EQ(dwell.velocity, before);
}

// A base that leans to one side from 9 to 45 s tilts gravity in both halves of the dwell, and its spectrum falls so steeply that the lowest
// bins stand out of those above them: 150 sigma of a sine were put in. The gyros feel the tilt.
TEST(DwellLines, BaseThatTiltsToAndFroIsNoLine) {
  constexpr double gravity = 9.8, tilt = 1e-3, from_s = 9.0, until_s = 45.0;
  Dwell dwell(0.0);
  for (std::size_t i = 0; i < dwell.data.size(); ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    const bool leans = t >= from_s && t < until_s;
    dwell.velocity[i][0] = gravity / rate_hz + dwell.velocity[i][2];
    dwell.velocity[i][2] += leans ? gravity * tilt / rate_hz : 0.0;
    dwell.theta[i][1] += t == from_s ? tilt : t == until_s ? -tilt : 0.0;
  }
  dwell.data.delta_theta = dwell.theta;
  dwell.data.delta_v = dwell.velocity;
  const AngleVelocity before = dwell.velocity;
  subtract_dwell_lines(dwell.data, dwell.segments, {}, dwell.theta, dwell.velocity);
  EXPECT_EQ(dwell.velocity, before);
}

// A base that rocks by 6 arcsec about y, and gyros with white noise of their integral; without `with_gravity` a line of the gyro's own.
void rock(Dwell& dwell, bool with_gravity) {
  constexpr double gravity = 9.8, tilt = 3e-5, angle_noise = 1e-6;
  std::mt19937_64 engine(11);
  std::normal_distribution<double> normal(0.0, angle_noise);
  const auto angle = [](double t) { return tilt * std::sin(2.0 * std::numbers::pi * frequency_hz * t); };
  double last = normal(engine);
  for (std::size_t i = 0; i < dwell.data.size(); ++i) {
    const double t = static_cast<double>(i) / rate_hz, now = normal(engine);
    dwell.theta[i][1] = angle(t + 1.0 / rate_hz) - angle(t) + now - last;
    dwell.velocity[i][0] += gravity / rate_hz;
    dwell.velocity[i][2] += with_gravity ? gravity * angle(t + 0.5 / rate_hz) / rate_hz : 0.0;
    last = now;
  }
  dwell.data.delta_theta = dwell.theta;
  dwell.data.delta_v = dwell.velocity;
}

// Without its line the attitude would be another at the dwell's end.
TEST(DwellLines, RockingWithWhichGravityTurnsIsTheBases) {
  Dwell dwell(0.0);
  rock(dwell, true);
  const AngleVelocity before = dwell.theta;
  for (const VibrationLine& line : subtract_dwell_lines(dwell.data, dwell.segments, {}, dwell.theta, dwell.velocity)) {
    EXPECT_GE(line.axis, 3);
  }
  EXPECT_EQ(dwell.theta, before);
}

TEST(DwellLines, LineOfAGyroWithWhichGravityStandsStillIsTakenOut) {
  Dwell dwell(0.0);
  rock(dwell, false);
  const auto lines = subtract_dwell_lines(dwell.data, dwell.segments, {}, dwell.theta, dwell.velocity);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.front().axis, 1);
  EXPECT_NEAR(lines.front().frequency_hz, frequency_hz, 0.1 / length_s);
}

TEST(DwellLines, NoiseAloneIsLeftAlone) {
  Dwell dwell(0.0);
  const AngleVelocity before = dwell.velocity;
  EXPECT_TRUE(subtract_dwell_lines(dwell.data, dwell.segments, {}, dwell.theta, dwell.velocity).empty());
  EXPECT_EQ(dwell.velocity, before);
}

}  // namespace
}  // namespace selfcal::diagnosis
