// Tables that do not go from stop to stop, made here: forth and back all the time, and a sensor that is mounted anew for each of its axes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double dt = 0.005, g = 9.80665;
constexpr double gyro_sigma = 1e-3, force_sigma = 5e-3;  // white, of a sample

// A table whose axis is vertical; the sensor's axes on it are the columns of `mounted`. Response of the gyros: `gain` times the true rate.
struct Table {
  PoseInput input;
  std::mt19937 random{3};
  std::normal_distribution<double> normal;
  Matrix3 mounted = Matrix3::Identity(), gain;
  Vector3 bias = Vector3(0.004, -0.002, 0.003);
  double angle = 0.0;

  Table() {
    gain << 1.002, 0.004, -0.003, 0.001, 0.997, 0.006, -0.005, 0.002, 1.004;
    input.accel_unit = 1.0;
  }
  void sample(double rate) {
    angle += rate * dt;
    const auto noisy = [this](const Vector3& v, double sigma) {
      return std::array{v.x() + sigma * normal(random), v.y() + sigma * normal(random), v.z() + sigma * normal(random)};
    };
    const Vector3 up = mounted.transpose() * Vector3::UnitZ();
    input.time_s.push_back(dt * static_cast<double>(input.time_s.size() + 1));
    input.gyro.push_back(noisy(gain * (rate * up) + bias, gyro_sigma));
    input.accel.push_back(noisy(g * up, force_sigma));
    input.outer.push_back(angle);
    input.inner.push_back(0.0);
  }
  void go(double rate, double seconds) {
    for (int k = 0; k < static_cast<int>(seconds / dt); ++k) {
      sample(rate);
    }
  }
  // 20 deg either way at half a hertz, in quanta of 0.005 deg, read `late` samples late.
  void oscillate(double seconds, std::ptrdiff_t late) {
    for (int k = 0; k < static_cast<int>(seconds / dt); ++k) {
      const double phase = std::numbers::pi * dt * (k + 0.5);
      sample(20.0 * units::degree * std::numbers::pi * std::cos(phase));
    }
    const double quantum = 0.005 * units::degree;
    for (double& a : input.outer) {
      a = quantum * std::round(a / quantum);
    }
    std::rotate(input.outer.begin(), input.outer.end() - late, input.outer.end());
    std::fill(input.outer.begin(), input.outer.begin() + late, 0.0);
  }
};

TEST(TableMotion, ForthAndBackAllTheTime) {
  Table t;
  constexpr std::ptrdiff_t late = 9;
  t.oscillate(120.0, late);
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.read_outs && d.read_outs->axes.size() == 1 && d.read_outs->clock);
  const ReadOutAxis& axis = d.read_outs->axes.front();
  EXPECT_TRUE(axis.oscillates);
  EXPECT_NEAR(axis.rows, 120, 2);  // reversals
  // 24000 samples of 1e-3 rad/s beside a rate of 0.78 rad/s rms: 8e-6 each, or 5 of the sigma that is said.
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(axis.response(k), t.gain(k, 2), std::max(4e-5, 5.0 * axis.sigma(k))) << k;
    EXPECT_LT(axis.sigma(k), 2e-4);
    EXPECT_NEAR(d.read_outs->gyro_bias(k), t.bias(k), 5.0 * d.read_outs->gyro_bias_sigma(k));
  }
  // Samples are means over their intervals here, and the delay is a whole number of them.
  EXPECT_NEAR(d.read_outs->clock->delay_s, dt * static_cast<double>(late), 0.5 * dt);
  EXPECT_GE(d.read_outs->clock->delay_sigma_s, 0.5 * dt);
}

TEST(TableMotion, WhatTheGyrosDoNotShowIsNoReadOut) {
  Table t;
  t.oscillate(120.0, 0);
  for (std::size_t i = 0; i < t.input.gyro.size(); ++i) {
    t.input.outer[i] = 0.3 * std::sin(1.7 * t.input.time_s[i]);
  }
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  EXPECT_FALSE(d.read_outs);
}

TEST(TableMotion, EachMountIsAnAxisOfItsOwn) {
  Table t;
  const auto turned = [](const Vector3& axis, double by) { return matrix_from_rotation_vector(by * axis); };
  constexpr double quarter = std::numbers::pi / 2.0;
  for (const Matrix3& mounted : {Matrix3(turned(Vector3::UnitY(), -quarter)),
                                 Matrix3(turned(Vector3::UnitX(), quarter)), Matrix3(Matrix3::Identity())}) {
    t.mounted = mounted;  // x, y, z up
    t.go(0.0, 8.0);
    for (const double rate : {0.5, -0.5, 1.0, -1.0, 2.0, -2.0}) {
      t.go(rate, 8.0);
    }
    t.go(0.0, 8.0);
  }
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  ASSERT_TRUE(d.read_outs) << d.failure;
  ASSERT_EQ(d.read_outs->axes.size(), 3u);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const ReadOutAxis& axis = d.read_outs->axes[static_cast<std::size_t>(k)];
    EXPECT_EQ(axis.rows, 6);
    // A mean over 5 s: 3e-5 rad/s, at rates of 1.3 rad/s rms.
    for (Eigen::Index i = 0; i < 3; ++i) {
      EXPECT_NEAR(axis.response(i), t.gain(i, k), std::max(1e-4, 5.0 * axis.sigma(i))) << k << i;
      EXPECT_LT(axis.sigma(i), 3e-4);
    }
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
