// Logs of gyros alone and of accelerometers alone, made here: what they answer, and what they say that they cannot show.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 50.0, dt = 1.0 / rate_hz;
constexpr double gyro_sigma = 1e-3, accel_sigma = 1e-3;  // rad/s and g, white, of a sample

// Stands of `stand_s` with turns of 90 deg in 3 s between them, about z and y of the sensor by turns. Raw values: rad/s, g.
struct Log {
  PoseInput input;
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  Vector3 u = Vector3(0.0, 0.0, 1.0), gyro_bias = Vector3(0.02, -0.01, 0.03), accel_bias = Vector3(0.01, -0.02, 0.03);
  double gain = 0.9, angle = 0.0;

  explicit Log(Sensors sensors) { input.sensors = sensors; }
  void sample(const Vector3& rate) {
    u = matrix_from_rotation_vector(-rate * dt) * u;
    input.time_s.push_back(dt * static_cast<double>(input.time_s.size() + 1));
    const auto noisy = [&](const Vector3& v, double sigma) {
      return std::array{v.x() + sigma * normal(random), v.y() + sigma * normal(random), v.z() + sigma * normal(random)};
    };
    const bool gyros = input.sensors != Sensors::accelerometers, accelerometers = input.sensors != Sensors::gyros;
    input.gyro.push_back(gyros ? noisy(gain * rate + gyro_bias, gyro_sigma) : std::array<double, 3>{});
    input.accel.push_back(accelerometers ? noisy(u + accel_bias, accel_sigma) : std::array<double, 3>{});
  }
  void stand(double seconds) {
    for (int k = 0; k < static_cast<int>(seconds * rate_hz); ++k) {
      sample(Vector3::Zero());
    }
  }
  // By a quarter of a turn, as a table would read it.
  void turn(const Vector3& axis) {
    constexpr double turn_s = 3.0, by = std::numbers::pi / 2.0;
    const int n = static_cast<int>(turn_s * rate_hz);
    for (int k = 0; k < n; ++k) {
      sample(axis * by / turn_s * (1.0 - std::cos(2.0 * std::numbers::pi * (k + 0.5) / n)));
    }
  }
  bool says_invisible(const PoseDiagnosis& d, const std::string& words) const {
    return std::any_of(d.invisible.begin(), d.invisible.end(),
                       [&](const std::string& said) { return said.find(words) != std::string::npos; });
  }
};

// White noise of a sample's sigma: of means over tau it is sigma/sqrt(tau rate). Five of its own sigma, which the means that do not overlap give.
void expect_white(const std::vector<RestNoise>& all, double sigma) {
  ASSERT_GE(all.size(), 3u);
  EXPECT_DOUBLE_EQ(all.front().tau_s, 1.0);
  for (const RestNoise& n : all) {
    const double expected = sigma / std::sqrt(n.tau_s * rate_hz);
    for (const double deviation : n.deviation) {
      EXPECT_NEAR(deviation, expected, 5.0 * expected / std::sqrt(2.0 * n.freedom)) << n.tau_s << " s";
    }
  }
}

TEST(OneTriad, AccelerometersAloneAreCalibratedByGravity) {
  Log log(Sensors::accelerometers);
  for (int k = 0; k < 24; ++k) {
    log.stand(15.0);
    log.turn(Vector3(k % 2 == 0 ? 0.8 : 0.0, 0.6, k % 2 == 0 ? 0.0 : 0.8));
  }
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 24);
  EXPECT_TRUE(d.by_poses);
  EXPECT_TRUE(d.accel_adequate);
  for (const PoseParameter& p : d.accel_parameters) {
    for (int axis = 0; axis < 3; ++axis) {
      if (p.name == std::string("bias_") + "xyz"[axis]) {
        EXPECT_TRUE(p.determined);
        EXPECT_NEAR(p.value, log.accel_bias(axis), 5.0 * p.sigma);
      }
    }
  }
  expect_white(d.accel_noise, accel_sigma);
  EXPECT_TRUE(d.gyro_noise.empty());
  EXPECT_TRUE(d.gyro_named.empty() && d.gyro_parameters.empty());
  EXPECT_EQ(d.turns, 0);
  EXPECT_TRUE(log.says_invisible(d, "gyros: the log holds none"));
  EXPECT_TRUE(log.says_invisible(d, "a turn about the vertical is not seen"));
}

TEST(OneTriad, FewPosesOfAccelerometersTellTheirNoise) {
  Log log(Sensors::accelerometers);
  log.stand(120.0);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_FALSE(d.by_poses);
  expect_white(d.accel_noise, accel_sigma);
  EXPECT_TRUE(log.says_invisible(d, "fewer than 6 static poses: 1"));
}

// What differs between stands is no noise of a stand.
TEST(OneTriad, GyrosAloneAtRest) {
  Log log(Sensors::gyros);
  for (int k = 0; k < 6; ++k) {
    log.stand(40.0);
    log.turn(k % 2 == 0 ? Vector3::UnitZ() : Vector3::UnitY());
    log.gyro_bias.x() += 2.0 * gyro_sigma / std::sqrt(rate_hz);
  }
  for (int k = 0; k < static_cast<int>(5.0 * rate_hz); ++k) {  // a steady turn is no stand, whatever the unit
    log.sample(0.1 * Vector3::UnitZ());
  }
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 6);
  EXPECT_FALSE(d.by_poses);
  EXPECT_TRUE(d.accel_adequate);
  expect_white(d.gyro_noise, gyro_sigma);
  EXPECT_TRUE(d.accel_noise.empty());
  EXPECT_NEAR(d.gyro_bias[1], -0.01, 5.0 * gyro_sigma / std::sqrt(6.0 * 38.0 * rate_hz));
  EXPECT_TRUE(log.says_invisible(d, "accelerometers: the log holds none"));
  EXPECT_TRUE(log.says_invisible(d, "scale factors and misalignment of the gyros"));
}

TEST(OneTriad, GyrosAloneOnATable) {
  Log log(Sensors::gyros);
  const auto follow = [&](double by) {
    while (log.input.outer.size() < log.input.time_s.size()) {
      log.angle += by;
      log.input.outer.push_back(log.angle);
      log.input.inner.push_back(0.0);
    }
  };
  for (int k = 0; k < 10; ++k) {
    log.stand(8.0);
    follow(0.0);
    const std::size_t before = log.input.time_s.size();
    log.turn(Vector3::UnitZ());
    const auto n = static_cast<double>(log.input.time_s.size() - before);
    for (std::size_t j = before; j < log.input.time_s.size(); ++j) {
      log.angle += std::numbers::pi / 2.0 / n *
                   (1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(j - before) + 0.5) / n));
      log.input.outer.push_back(log.angle);
      log.input.inner.push_back(0.0);
    }
  }
  log.stand(8.0);
  follow(0.0);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.read_outs);
  ASSERT_FALSE(d.read_outs->axes.empty());
  const ReadOutAxis& axis = d.read_outs->axes.front();
  EXPECT_NEAR(axis.response.z(), log.gain, 5.0 * axis.sigma.z());
  EXPECT_LT(axis.sigma.z(), 1e-3);
  EXPECT_FALSE(d.read_outs->tilt);  // the accelerometers' question
  EXPECT_FALSE(log.says_invisible(d, "scale factors and misalignment of the gyros"));
}

TEST(OneTriad, WhatNeverRestsAndHasNoReadOutIsRefused) {
  Log log(Sensors::gyros);
  for (int k = 0; k < 60; ++k) {
    log.turn(Vector3::UnitZ());
  }
  EXPECT_NE(diagnose_poses(log.input, 0.01).failure.find("gyros alone"), std::string::npos);
}

}  // namespace
}  // namespace selfcal::diagnosis
