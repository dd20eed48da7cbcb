// Lines that go on alike through dwells, made up here: found with their frequency, taken out, and nothing else is.
#include "estimator/diagnosis/noise/coherent_lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 50.0, dwell_s = 50.0;
constexpr std::size_t dwells = 12, samples = static_cast<std::size_t>(rate_hz * dwell_s);
constexpr double noise = 1e-4;  // m/s^2, of one sample
// A sine's amplitude fitted to all samples scatters by sqrt(2 / n) of the noise's sigma: 8e-7 m/s^2.
const double amplitude_sigma = noise * std::sqrt(2.0 / static_cast<double>(samples * dwells));

// Accelerometer z: white noise and one sine a dwell, whose phase starts anew in each.
struct Dwells {
  std::vector<double> time;
  AngleVelocity theta, velocity;
  ImuData data;
  std::vector<Segment> stretches;

  template <typename Frequency>
  Dwells(double amplitude, const Frequency& frequency_hz) {
    std::mt19937_64 engine(11);
    std::normal_distribution<double> normal(0.0, noise);
    std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
    for (std::size_t d = 0; d < dwells; ++d) {
      const double at = phase(engine), omega = 2.0 * std::numbers::pi * frequency_hz(d);
      for (std::size_t i = 0; i < samples; ++i) {
        const double t = static_cast<double>(i) / rate_hz;
        // The mean over a sample.
        const double wave =
            (std::cos(omega * t + at) - std::cos(omega * (t + 1.0 / rate_hz) + at)) * rate_hz / omega * amplitude;
        velocity.push_back({0.0, 0.0, (wave + normal(engine)) / rate_hz});
        time.push_back(static_cast<double>(time.size() + 1) / rate_hz);
      }
      stretches.push_back({.first = d * samples, .last = (d + 1) * samples});
    }
    theta.assign(velocity.size(), {0.0, 0.0, 0.0});
    data.sample_rate_hz = rate_hz;
    data.time_s = time;
    data.delta_theta = theta;
    data.delta_v = velocity;
  }
};

TEST(CoherentLines, OneFrequencyIsFoundAndTakenOut) {
  constexpr double hz = 17.3137, amplitude = 1e-3;
  const Dwells d(amplitude, [&](std::size_t) { return hz; });
  const CoherentLines found = coherent_lines(d.data, d.stretches);
  ASSERT_EQ(found.lines.size(), 1U);
  EXPECT_EQ(found.lines.front().axis, 5);
  // A bin is 20 mHz wide, the peak found to a tenth of one; the amplitude then loses (pi/10)^2/6 = 1.6 %.
  EXPECT_NEAR(found.lines.front().frequency_hz, hz, 2e-3);
  EXPECT_NEAR(found.lines.front().amplitude, amplitude, 0.016 * amplitude + 4.0 * amplitude_sigma);
  double square = 0.0;
  for (const auto& v : found.without.data().delta_v) {
    square += std::pow(v[2] * rate_hz, 2) / static_cast<double>(d.velocity.size());
  }
  // The sine's square is 50 times the noise's; a tenth of a bin leaves (pi/10)^2/3 of it.
  EXPECT_LT(square, noise * noise + 0.033 * 0.5 * amplitude * amplitude);
}

// Half of a bin apart, one in the first half of the dwells, one in the other: no sine is both.
TEST(CoherentLines, TwoInOneBinAreNone) {
  const Dwells d(1e-3, [](std::size_t k) { return k < dwells / 2 ? 17.300 : 17.318; });
  EXPECT_TRUE(coherent_lines(d.data, d.stretches).lines.empty());
}

TEST(CoherentLines, NoiseHasNone) {
  const Dwells d(0.0, [](std::size_t) { return 1.0; });
  const CoherentLines found = coherent_lines(d.data, d.stretches);
  EXPECT_TRUE(found.lines.empty());
}

}  // namespace
}  // namespace selfcal::diagnosis
