// Loudness of noise made up here, in the time domain, with no part of what finds it.
#include "estimator/diagnosis/noise/band_loudness.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 20.0;
constexpr std::size_t n = 36000;  // half an hour

// White noise of one a sample, times 3 in seconds [600, 900).
std::vector<double> shaken(unsigned seed, double louder) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  std::vector<double> series(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    series[i] = (t >= 600.0 && t < 900.0 ? louder : 1.0) * normal(engine);
  }
  return series;
}

double mean_between(const BandLoudness& band, double from_s, double to_s) {
  double sum = 0.0, count = 0.0;
  for (std::size_t k = 0; k < band.power.size(); ++k) {
    const double t = band.step_s * static_cast<double>(k);
    if (t >= from_s && t < to_s) {
      sum += band.power[k];
      count += 1.0;
    }
  }
  return sum / count;
}

// Mean of the squares of powers whose mean is one.
double spread(const BandLoudness& band) {
  double sum = 0.0, squares = 0.0;
  for (const double p : band.power) {
    sum += p;
    squares += p * p;
  }
  return squares * static_cast<double>(band.power.size()) / (sum * sum);
}

// A sixth of the time at nine times the power: the mean is 7/3, the mean square 43/3, and the spread 2.63, which bands are to have without what
// chance adds. Windows reach from 1 s to 14 s over the edges of 300 s, which takes up to 14/300 of the loud part. The squares of a band are
// known to 1/sqrt(300 s times its width): 22 % for 0.07 Hz, and below 0.1 Hz twice as much is let pass.
TEST(BandLoudness, FindsWhenAndHowLoud) {
  const auto bands = loudness_of_bands(mirrored_lines(shaken(3, 3.0)), rate_hz);
  ASSERT_FALSE(bands.empty());
  EXPECT_DOUBLE_EQ(bands.back().below_hz, 0.5 * rate_hz);
  for (std::size_t k = 1; k < bands.size(); ++k) {
    const double width_hz = bands[k].below_hz - bands[k - 1].below_hz, reach_s = std::max(1.0, 1.0 / width_hz);
    EXPECT_NEAR(spread(bands[k]), 2.63, 2.63 * (reach_s / 300.0 + 2.0 / std::sqrt(300.0 * width_hz)))
        << bands[k].below_hz;
    EXPECT_NEAR(mean_between(bands[k], 0.0, 1e9), 1.0, 1e-9);
    // More than half of the logarithm of nine, and no more than it by chance.
    const double ratio =
        mean_between(bands[k], 600.0 + reach_s, 900.0 - reach_s) / mean_between(bands[k], 900.0 + reach_s, 1700.0);
    EXPECT_GT(ratio, 3.0) << bands[k].below_hz;
    EXPECT_LT(ratio, 9.0 * (1.0 + 2.0 / std::sqrt(300.0 * width_hz))) << bands[k].below_hz;
  }
}

// Chance of itself is no loudness: the widest bands know that best.
TEST(BandLoudness, SteadyNoiseHasNone) {
  int told = 0, bands_of_all = 0;
  for (unsigned seed = 10; seed < 30; ++seed) {
    for (const BandLoudness& band : loudness_of_bands(mirrored_lines(shaken(seed, 1.0)), rate_hz)) {
      told += band.power.size() > 1 ? 1 : 0;
      ++bands_of_all;
    }
  }
  // A tenth of the mean square is asked for; of 160 bands few have that by chance, the narrow ones below.
  EXPECT_LE(told, 24) << bands_of_all;
}

TEST(BandLoudness, LengthsHaveNoLargePrimes) {
  EXPECT_EQ(quick_length(1024), 1024U);
  EXPECT_EQ(quick_length(1021), 1000U);      // 2^3 5^3
  EXPECT_EQ(quick_length(184718), 184320U);  // 2^12 3^2 5
  EXPECT_EQ(quick_length(1), 1U);
}

// The series turned back on itself is even: its lines are real but for half a sample's shift, and its mean is the first one.
TEST(BandLoudness, LinesOfAConstantAreItsMean) {
  const auto lines = mirrored_lines(std::vector<double>(64, 2.0));
  ASSERT_EQ(lines.size(), 65U);
  EXPECT_NEAR(lines[0].real(), 2.0 * 128.0, 1e-9);
  for (std::size_t k = 1; k < lines.size(); ++k) {
    EXPECT_NEAR(std::abs(lines[k]), 0.0, 1e-9);
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
