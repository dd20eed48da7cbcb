// The noise terms of simulated sensors, whose densities are known from how they were made (IEEE Std 952-1997, annex C).
#include "tools/report/noise_terms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace selfcal::report {
namespace {

constexpr double rate_hz = 50.0;
constexpr double dt = 1.0 / rate_hz;
constexpr double dwell_s = 120.0;
constexpr int dwells = 12;

// Increments of one sensor over one dwell, by sample number.
using Source = std::function<double(std::size_t)>;
using MakeSource = std::function<Source(std::mt19937_64&)>;

// Six independent sensors of one kind through `dwells` dwells; every dwell starts its source anew.
std::vector<AllanPoint> simulate(const MakeSource& make, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto samples = static_cast<std::size_t>(dwell_s * rate_hz);
  Recording recording;
  recording.sample_rate_hz = rate_hz;
  std::vector<Segment> segments;
  for (int dwell = 0; dwell < dwells; ++dwell) {
    std::array<Source, 6> sources;
    std::generate(sources.begin(), sources.end(), [&] { return make(random); });
    segments.push_back({false, recording.size(), recording.size() + samples, 0.0, 0.0, 0.0, 0.0});
    for (std::size_t k = 0; k < samples; ++k) {
      recording.time_s.push_back(dt * static_cast<double>(recording.size() + 1));
      recording.delta_theta_rad.push_back({sources[0](k), sources[1](k), sources[2](k)});
      recording.delta_v_mps.push_back({sources[3](k), sources[4](k), sources[5](k)});
    }
  }
  return allan_deviation(recording, segments);
}

double normal(std::mt19937_64& random) { return std::normal_distribution<double>()(random); }

// White noise of N per square root of a second.
Source white(std::mt19937_64& random, double N) {
  return [&random, N](std::size_t) { return N * std::sqrt(dt) * normal(random); };
}

// Rate random walk of K per square root of a second, on white noise of N.
Source walk(std::mt19937_64& random, double N, double K) {
  return [&random, N, K, rate = 0.0](std::size_t) mutable {
    rate += K * std::sqrt(dt) * normal(random);
    return rate * dt + N * std::sqrt(dt) * normal(random);
  };
}

// The integral of white noise, rounded to whole quanta: the rounding error is even over one quantum, so Q is its
// standard deviation, quantum / sqrt(12). It is new in each sample where the integral moves by a part of a quantum that
// cannot be foreseen: with steps of s quanta the errors of neighbours are correlated by exp(-2 pi^2 s^2).
Source quantised(std::mt19937_64& random, double N, double quantum) {
  const double start = quantum * std::uniform_real_distribution<double>()(random);
  return [&random, N, quantum, integral = start](std::size_t) mutable {
    const double before = quantum * std::round(integral / quantum);
    integral += N * std::sqrt(dt) * normal(random);
    return quantum * std::round(integral / quantum) - before;
  };
}

// Flicker of bias instability B as Gauss-Markov processes an octave apart. Each of variance s^2 and time constant T has
// the two-sided density 2 s^2 T / (1 + (2 pi f T)^2); summed over T in octaves that is s^2 / (2 f ln 2), and B^2 / (2 pi f)
// is wanted: s^2 = B^2 ln 2 / pi.
Source flicker(std::mt19937_64& random, double N, double B) {
  constexpr int octaves = 18;  // T from 0.01 s to 1300 s
  const double s = B * std::sqrt(std::numbers::ln2 / std::numbers::pi);
  std::array<double, octaves> state{};
  for (double& value : state) {
    value = s * normal(random);
  }
  return [&random, N, s, state](std::size_t) mutable {
    double rate = 0.0;
    double T = 0.01;
    for (double& value : state) {
      const double keep = std::exp(-dt / T);
      value = keep * value + s * std::sqrt(1.0 - keep * keep) * normal(random);
      rate += value;
      T *= 2.0;
    }
    return rate * dt + N * std::sqrt(dt) * normal(random);
  };
}

const NoiseTermFit* find(const NoiseFit& fit, NoiseTerm term) {
  const auto found =
      std::find_if(fit.terms.begin(), fit.terms.end(), [&](const NoiseTermFit& t) { return t.term == term; });
  return found == fit.terms.end() ? nullptr : &*found;
}

struct Score {
  int fits = 0, found = 0, others = 0;  // fits; those with the term; terms besides it and those allowed
  double mean_ratio = 0.0;              // coefficient over truth
  double z_squared = 0.0;               // mean of ((coefficient - truth) / sigma)^2
};

Score score(const MakeSource& make, NoiseTerm term, double truth, const std::vector<NoiseTerm>& allowed) {
  constexpr int seeds = 12;
  Score result;
  for (int seed = 1; seed <= seeds; ++seed) {
    const std::vector<AllanPoint> points = simulate(make, static_cast<std::uint64_t>(seed));
    for (std::size_t sensor = 0; sensor < 6; ++sensor) {
      const NoiseFit fit = fit_noise_terms(points, sensor);
      ++result.fits;
      for (const NoiseTermFit& found : fit.terms) {
        const bool known = found.term == term || std::count(allowed.begin(), allowed.end(), found.term) > 0;
        result.others += known ? 0 : 1;
      }
      if (const NoiseTermFit* found = find(fit, term)) {
        ++result.found;
        result.mean_ratio += found->coefficient / truth;
        result.z_squared += std::pow((found->coefficient - truth) / found->sigma, 2);
      }
    }
  }
  result.mean_ratio /= std::max(1, result.found);
  result.z_squared /= std::max(1, result.found);
  return result;
}

// 72 fits: the mean of z^2 has a sigma of sqrt(2 / 72) = 0.17. The formal sigma neglects that neighbouring octaves share
// data: 2.0 leaves room for that and for chance; a sigma half as large as the true one gives 4. Where data are many it
// is larger than chance alone, for no point counts for more than 5 % of its variance: no lower bound but that it is not
// ten times as large.
constexpr double z_low = 0.01;
constexpr double z_high = 2.0;

void expect_good(const Score& s, double bias) {
  testing::Test::RecordProperty("z_squared", std::to_string(s.z_squared));
  EXPECT_NEAR(s.mean_ratio, 1.0, bias);
  EXPECT_GT(s.z_squared, z_low);
  EXPECT_LT(s.z_squared, z_high);
}

// Standard: N is the deviation at 1 s, K at 3 s, R at sqrt(2) s, Q at sqrt(3) s, and B over 0.664 the flat part.
TEST(NoiseTerms, AreThoseOfTheStandard) {
  const auto at = [](NoiseTerm term, double tau) { return deviation_of({term, 7.0, 0.0}, tau); };
  EXPECT_NEAR(at(NoiseTerm::quantisation, std::sqrt(3.0)), 7.0, 1e-12);
  EXPECT_NEAR(at(NoiseTerm::random_walk, 1.0), 7.0, 1e-12);
  EXPECT_NEAR(at(NoiseTerm::bias_instability, 5.0), 7.0 * 0.664, 7.0 * 0.0005);
  EXPECT_NEAR(at(NoiseTerm::rate_random_walk, 3.0), 7.0, 1e-12);
  EXPECT_NEAR(at(NoiseTerm::ramp, std::numbers::sqrt2), 7.0, 1e-12);
  for (int k = 0; k < noise_term_count; ++k) {
    const auto term = static_cast<NoiseTerm>(k);
    EXPECT_NEAR(std::log2(at(term, 2.0) / at(term, 1.0)), slope_of(term), 1e-12);
    EXPECT_EQ(slope_of(term), -1.0 + 0.5 * k);
  }
}

TEST(NoiseTerms, OfWhiteNoiseAreItsDensityAlone) {
  const double N = 3e-5;
  const Score s = score([N](auto& random) { return white(random, N); }, NoiseTerm::random_walk, N, {});
  EXPECT_EQ(s.found, s.fits);
  // A term that is not there comes out of chance: five candidates at 3 sigma (0.13 % each) and BIC.
  EXPECT_LE(s.others, s.fits / 20);
  expect_good(s, 0.01);
}

TEST(NoiseTerms, OfAQuantisedSensorHaveTheQuantum) {
  // Steps of 0.45 quanta: a correlation of 0.018, and at one sample the variance is 0.25 squared quanta of rounding beside
  // 0.2 of white noise.
  const double N = 3e-5;
  const double quantum = N * std::sqrt(dt) / 0.45;
  const Score s = score([=](auto& random) { return quantised(random, N, quantum); }, NoiseTerm::quantisation,
                        quantum / std::sqrt(12.0), {NoiseTerm::random_walk});
  EXPECT_EQ(s.found, s.fits);
  EXPECT_LE(s.others, s.fits / 20);
  expect_good(s, 0.02);  // half the correlation of neighbours
}

TEST(NoiseTerms, OfARateRandomWalkHaveItsDensity) {
  // Crosses the white noise at sqrt(3) N / K = 5 s.
  const double N = 3e-5;
  const double K = std::sqrt(3.0) * N / 5.0;
  const Score s = score([=](auto& random) { return walk(random, N, K); }, NoiseTerm::rate_random_walk, K,
                        {NoiseTerm::random_walk, NoiseTerm::ramp, NoiseTerm::bias_instability});
  EXPECT_GE(s.found, s.fits * 9 / 10);
  expect_good(s, 0.1);
}

TEST(NoiseTerms, OfARampHaveItsRate) {
  const double N = 3e-5;
  const double R = 2e-5;  // at 40 s: sqrt(1/2) R tau is a hundred times the white noise
  const auto ramp = [=](auto& random) {
    return [noise = white(random, N), R](std::size_t k) {
      return R * dt * dt * (static_cast<double>(k) + 0.5) + noise(k);
    };
  };
  const Score s = score(ramp, NoiseTerm::ramp, R, {NoiseTerm::random_walk});
  EXPECT_EQ(s.found, s.fits);
  EXPECT_LE(s.others, s.fits / 20);
  // The ramp repeats from dwell to dwell and has no scatter of its own: its sigma is that of a random term and too large.
  EXPECT_NEAR(s.mean_ratio, 1.0, 0.01);
  EXPECT_LT(s.z_squared, z_high);
}

TEST(NoiseTerms, OfFlickerHaveItsBiasInstability) {
  // The white noise falls below the flat part of 0.664 B at 1 s.
  const double N = 3e-5;
  const double B = N / 0.664;
  const Score s = score([=](auto& random) { return flicker(random, N, B); }, NoiseTerm::bias_instability, B,
                        {NoiseTerm::random_walk, NoiseTerm::rate_random_walk});
  EXPECT_GE(s.found, s.fits * 9 / 10);
  EXPECT_NEAR(s.mean_ratio, 1.0, 0.1);
  EXPECT_LT(s.z_squared, z_high);
}

// The test can fail: against another density it does.
TEST(NoiseTerms, AreToldFromAThirdMore) {
  const double N = 3e-5;
  const Score s = score([N](auto& random) { return white(random, N); }, NoiseTerm::random_walk, N * 1.3, {});
  EXPECT_GT(s.z_squared, z_high);
}

TEST(NoiseTerms, OfNothingAreNone) {
  EXPECT_TRUE(fit_noise_terms({}, 0).terms.empty());
  std::vector<AllanPoint> silent(8);
  for (std::size_t k = 0; k < silent.size(); ++k) {
    silent[k].tau_s = static_cast<double>(1U << k);
    silent[k].freedom = 100.0;
  }
  EXPECT_TRUE(fit_noise_terms(silent, 0).terms.empty());  // a channel that stands still
}

}  // namespace
}  // namespace selfcal::report
