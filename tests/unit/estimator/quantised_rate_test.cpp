// White noise of a rate behind a quantum of up to a hundred times the noise of a sample.
#include "estimator/models/quantised_rate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace selfcal {
namespace {

constexpr double rate_hz = 50.0, quantum = 4.85e-7;  // 0.1 arcsec
constexpr int dwells = 18, samples = 3500;           // 70 s each

struct Recorded {
  std::vector<std::array<double, 3>> increments;
  std::vector<Segment> segments;
};

// Every dwell and axis at its own steady rate within +-15 deg/h (73 urad/s, three quanta a sample), remainders carried on.
Recorded recorded(double asd, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> mean(-7.3e-5, 7.3e-5);
  Recorded r;
  std::array<double, 3> rest{};
  for (int d = 0; d < dwells; ++d) {
    Segment s;
    s.first = r.increments.size();
    const std::array<double, 3> rate = {mean(engine), mean(engine), mean(engine)};
    for (int i = 0; i < samples; ++i) {
      std::array<double, 3> put_out{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double angle = rest[axis] + rate[axis] / rate_hz + asd / std::sqrt(rate_hz) * normal(engine);
        put_out[axis] = quantum * std::floor(angle / quantum);
        rest[axis] = angle - put_out[axis];
      }
      r.increments.push_back(put_out);
    }
    s.last = r.increments.size();
    r.segments.push_back(s);
  }
  return r;
}

class BehindAQuantum : public testing::TestWithParam<double> {};

// 108 periodograms of 32 s of 21 bins: the sum over the bins of one scatters like 21/2.63 of them (taper), so the
// density by 1/sqrt(108 * 8) = 3.4 % in the square and half of it in amplitude, twice that where white angle is
// fitted too: at least 1.7 %, and at most a tenth, where the quantum leaves only the bins between its lines. The truth
// lies within 4 of the sigma that the fit states; the first guess is as wrong as the whole quantum makes it.
TEST_P(BehindAQuantum, DensityIsFoundWithinItsSigma) {
  const double asd = GetParam() * quantum * std::sqrt(rate_hz);
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Recorded r = recorded(asd, seed);
    const QuantisedRate found = fit_quantised_rate(r.increments, rate_hz, r.segments, quantum, 32.0, 20.0 * asd);
    EXPECT_LT(std::abs(found.white_asd - asd), 4.0 * found.white_sigma) << found.white_asd / asd;
    EXPECT_GT(found.white_sigma, 0.017 * asd);
    EXPECT_LT(found.white_sigma, 0.1 * asd);
  }
}

INSTANTIATE_TEST_SUITE_P(NoiseOfASampleOverQuantum, BehindAQuantum, testing::Values(0.01, 0.03, 0.1, 1.0));

// Noise of a sample beyond the quantum: the error forgets within a sample and is white angle of quantum^2/12.
TEST(QuantumDensity, WhiteWhereTheNoiseIsLarge) {
  const double asd = 2.0 * quantum * std::sqrt(rate_hz);
  for (const double f : {0.1, 1.0, 20.0}) {
    const double sine = std::sin(3.14159265358979 * f / rate_hz);
    EXPECT_NEAR(
        quantum_density(f, 3e-5, quantum, asd, rate_hz) / (quantum * quantum / 12.0 * 4.0 * sine * sine * rate_hz), 1.0,
        1e-9);
  }
}

// The error's variance is quantum^2/12 whatever the noise: the angle's density, 1/(4 sin^2 fs^2) of the rate's, over all
// frequencies. Steps of 1/2000 of the band, lines of 1.4 Hz and wider.
TEST(QuantumDensity, HoldsAllOfTheVariance) {
  const double asd = 0.05 * quantum * std::sqrt(rate_hz);
  constexpr int steps = 2000;
  double variance = 0.0;
  for (int k = 0; k < steps; ++k) {
    const double f = rate_hz * ((k + 0.5) / steps - 0.5);
    const double sine = std::sin(3.14159265358979 * f / rate_hz);
    variance +=
        quantum_density(f, 3e-5, quantum, asd, rate_hz) / (4.0 * sine * sine * rate_hz * rate_hz) * rate_hz / steps;
  }
  EXPECT_NEAR(variance / (quantum * quantum / 12.0), 1.0, 1e-3);
}

TEST(BehindAQuantum, SaysNothingOfAShortRecording) {
  Recorded r = recorded(1e-7, 1);
  r.segments.resize(2);
  EXPECT_EQ(fit_quantised_rate(r.increments, rate_hz, r.segments, quantum, 32.0, 1e-7).white_asd, 0.0);
}

}  // namespace
}  // namespace selfcal
