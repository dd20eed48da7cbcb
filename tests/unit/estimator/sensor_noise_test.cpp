// White noise of known density, at rates where the groups of the periodogram are whole samples and where they are not.
#include "estimator/models/sensor_noise.hpp"

#include <gtest/gtest.h>

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

// A ship's sway is a million times the noise's power; what of it leaks into the band must stay far below the noise.
TEST(SensorNoiseOnAMooredBase, SwayStaysOutOfTheDensity) {
  constexpr double rate_hz = 50.0, duration_s = 1800.0, sway_rad = 0.0175, period_s = 5.0, heave_m = 0.2;
  constexpr double gyro_asd = 2.9e-7, accel_asd = 5e-5, w = 2.0 * std::numbers::pi / period_s;
  const auto n = static_cast<std::size_t>(duration_s * rate_hz);
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  std::vector<double> time, gimbal(n, 0.0);
  std::vector<std::array<double, 3>> theta, velocity;
  for (std::size_t i = 0; i < n; ++i) {
    const double begin = static_cast<double>(i) / rate_hz, end = static_cast<double>(i + 1) / rate_hz;
    const double g = gyro_asd / std::sqrt(rate_hz), a = accel_asd / std::sqrt(rate_hz);
    const double turned = sway_rad * (std::sin(w * end) - std::sin(w * begin));
    const double risen = heave_m * w * (std::cos(w * end) - std::cos(w * begin));
    time.push_back(end);
    theta.push_back({turned + g * normal(engine), turned + g * normal(engine), turned + g * normal(engine)});
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
  // As above, with 500 pieces and white angle fitted beside: 1 % of amplitude. Four times that.
  EXPECT_NEAR(noise.gyro.white_asd / gyro_asd, 1.0, 0.04);
  EXPECT_NEAR(noise.accel.white_asd / accel_asd, 1.0, 0.04);
}

}  // namespace
}  // namespace selfcal
