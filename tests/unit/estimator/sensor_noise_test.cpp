// White noise of known density, at rates where the groups of the periodogram are whole samples and where they are not.
#include "estimator/models/sensor_noise.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace selfcal {
namespace {

class SensorNoiseAtRate : public testing::TestWithParam<double> {};

TEST_P(SensorNoiseAtRate, DensityIsFound) {
  const double rate_hz = GetParam();
  constexpr double gyro_asd = 3e-7, accel_asd = 5e-5, duration_s = 600.0;
  const auto n = static_cast<std::size_t>(duration_s * rate_hz);
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  std::vector<double> time;
  std::vector<std::array<double, 3>> theta, velocity;
  for (std::size_t i = 0; i < n; ++i) {
    time.push_back(static_cast<double>(i + 1) / rate_hz);
    const double g = gyro_asd / std::sqrt(rate_hz), a = accel_asd / std::sqrt(rate_hz);
    theta.push_back({g * normal(engine), g * normal(engine), g * normal(engine)});
    velocity.push_back({a * normal(engine), a * normal(engine), a * normal(engine) + 9.8 / rate_hz});
  }
  ImuData data;
  data.sample_rate_hz = rate_hz;
  data.time_s = time;
  data.delta_theta = theta;
  data.delta_v = velocity;
  const SensorNoise noise = estimate_sensor_noise(data, find_segments(data));
  // Accelerometers: 180 pieces of 3.2 s, 3 axes, 21 bins of which the taper leaves a third independent: 21 values of
  // one degree-pair each, 1/sqrt(180 * 21) = 1.6 % of density, and twice that where white angle is
  // fitted too; half of it in amplitude. Gyros: 18 pieces of 32 s: 5 % and 10 %. Four times these.
  EXPECT_NEAR(noise.accel.white_asd / accel_asd, 1.0, 0.064);
  EXPECT_NEAR(noise.gyro.white_asd / gyro_asd, 1.0, 0.2);
}

INSTANTIATE_TEST_SUITE_P(Rates, SensorNoiseAtRate, testing::Values(50.0, 90.0, 100.0, 200.0, 1000.0));

struct Moored {
  double rate_hz, gyro_asd;
  double quantum;         // rad, carried on; 0: none
  double gyro_tolerance;  // of the amplitude
};

class SensorNoiseOnAMooredBase : public testing::TestWithParam<Moored> {};

// A ship's sway is a million times the noise's power; what of it leaks into the band must stay far below the noise.
TEST_P(SensorNoiseOnAMooredBase, SwayStaysOutOfTheDensity) {
  constexpr double duration_s = 1800.0, sway_rad = 0.0175, roll_rad = 0.01, period_s = 5.0, heave_m = 0.2;
  constexpr double accel_asd = 5e-5, w = 2.0 * std::numbers::pi / period_s;
  // Two periods without a common one: the quanta's errors of a single sine are the same from period to period.
  const auto attitude = [](double t, double phase) {
    return sway_rad * std::sin(w * t) + roll_rad * std::sin(w / std::numbers::sqrt2 * t + phase);
  };
  const auto [rate_hz, gyro_asd, quantum, gyro_tolerance] = GetParam();
  const auto n = static_cast<std::size_t>(duration_s * rate_hz);
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  std::vector<double> time, gimbal(n, 0.0);
  std::vector<std::array<double, 3>> theta, velocity;
  std::array<double, 3> rest{};
  for (std::size_t i = 0; i < n; ++i) {
    const double begin = static_cast<double>(i) / rate_hz, end = static_cast<double>(i + 1) / rate_hz;
    const double g = gyro_asd / std::sqrt(rate_hz), a = accel_asd / std::sqrt(rate_hz);
    const double risen = heave_m * w * (std::cos(w * end) - std::cos(w * begin));
    time.push_back(end);
    std::array<double, 3> angle{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto phase = static_cast<double>(axis);
      const double whole = rest[axis] + attitude(end, phase) - attitude(begin, phase) + g * normal(engine);
      angle[axis] = quantum > 0.0 ? quantum * std::floor(whole / quantum) : whole;
      rest[axis] = whole - angle[axis];
    }
    theta.push_back(angle);
    velocity.push_back({a * normal(engine), a * normal(engine), risen + a * normal(engine) + 9.8 / rate_hz});
  }
  ImuData data;
  data.sample_rate_hz = rate_hz;
  data.time_s = time;
  data.delta_theta = theta;
  data.delta_v = velocity;
  data.gimbal_outer = data.gimbal_inner = gimbal;
  const SensorNoise noise = estimate_sensor_noise(data, find_segments(data));
  EXPECT_TRUE(noise.base_moves);
  EXPECT_NEAR(noise.gyro.white_asd / gyro_asd, 1.0, gyro_tolerance);
  EXPECT_NEAR(noise.accel.white_asd / accel_asd, 1.0, 0.04);
}

// As above, with 500 pieces and white angle fitted beside: 1 % of amplitude; four times that.
// 0.0007 deg/sqrt(h) behind a quantum of 0.1": 4 sin^2(pi f D)/D q^2/12 leaves the noise a quarter of the density at
// 1.9 Hz and a tenth at 3 Hz, squares of the 21 shares 0.19 in sum. 500 pieces, 3 axes, a third of the bins
// independent, half the information lost to the white angle: 1/sqrt(500 * 0.19 / 2) = 15 % of density, 7 % of amplitude.
INSTANTIATE_TEST_SUITE_P(NoQuantum, SensorNoiseOnAMooredBase, testing::Values(Moored{50.0, 2.9e-7, 0.0, 0.04}));
INSTANTIATE_TEST_SUITE_P(Quantum, SensorNoiseOnAMooredBase,
                         testing::Values(Moored{50.0, 2.04e-7, 4.85e-7, 0.28}, Moored{200.0, 2.04e-7, 4.85e-7, 0.28}));

// White noise of force behind a count that hides it above 2 Hz, the remainders carried on: dwells of 120 s at many attitudes.
class CountedForce : public testing::TestWithParam<double> {};

TEST_P(CountedForce, DensityBehindACoarseQuantumIsFound) {
  constexpr double rate_hz = 100.0, dwell_s = 120.0, asd = 4e-5;
  constexpr int dwells = 18;
  const double quantum = GetParam();
  std::mt19937_64 engine(2);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> level(-0.5, 0.5);  // what a lean of some degrees leaves
  std::vector<double> time;
  std::vector<std::array<double, 3>> theta, velocity;
  std::array<double, 3> sum{}, counted{};
  std::vector<Segment> segments;
  const auto n = static_cast<std::size_t>(dwell_s * rate_hz);
  for (int dwell = 0; dwell < dwells; ++dwell) {
    std::array<double, 3> f{level(engine), level(engine), level(engine)};
    f[static_cast<std::size_t>(dwell % 3)] = dwell % 2 == 0 ? 9.8 : -9.8;
    segments.push_back(
        {.first = time.size(), .last = time.size() + n, .start_s = dwell * dwell_s, .end_s = (dwell + 1) * dwell_s});
    for (std::size_t i = 0; i < n; ++i) {
      time.push_back(static_cast<double>(time.size() + 1) / rate_hz);
      theta.push_back({1e-9 * normal(engine), 1e-9 * normal(engine), 1e-9 * normal(engine)});
      velocity.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sum[axis] += f[axis] / rate_hz + asd / std::sqrt(rate_hz) * normal(engine);
        const double counts = std::floor(sum[axis] / quantum);
        velocity.back()[axis] = (counts - counted[axis]) * quantum;
        counted[axis] = counts;
      }
    }
  }
  segments.push_back(
      {.rotation = true, .first = time.size(), .last = time.size()});  // the dwells are several attitudes
  ImuData data;
  data.sample_rate_hz = rate_hz;
  data.time_s = time;
  data.delta_theta = theta;
  data.delta_v = velocity;
  const SensorNoise noise = estimate_sensor_noise(data, segments);
  EXPECT_FALSE(noise.base_moves);
  EXPECT_NEAR(noise.accel.quantum / quantum, 1.0, 1e-6);
  // 54 pieces of 32 s, three axes, 21 bins of which a third is independent: 3 % of the density, 1.5 % of its root. Five times that.
  EXPECT_NEAR(noise.accel.white_asd / asd, 1.0, 0.08);
}

INSTANTIATE_TEST_SUITE_P(Quanta, CountedForce, testing::Values(1e-4, 3e-4, 9e-4));

}  // namespace
}  // namespace selfcal
