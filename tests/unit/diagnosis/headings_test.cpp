// A fibre gyro that stands in four headings about the vertical, made here: what the Earth makes of its means is no bias.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 50.0, dt = 1.0 / rate_hz, g = 9.80665;
constexpr double latitude = 48.3 * units::degree, omega = 7.292115e-5;
constexpr double gyro_asd = 0.01 * units::degree_per_sqrt_hour, force_sigma = 5e-3;

// North, west, up; turned by `heading` about up. Quarters of a turn in 4 s, stands of a minute.
PoseInput headings(const Vector3& bias, int count) {
  PoseInput input;
  input.accel_unit = 1.0;
  input.latitude = latitude;
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  const auto noise = [&](double sigma) -> Vector3 {
    return sigma * Vector3(normal(random), normal(random), normal(random));
  };
  double heading = 0.3;
  const auto sample = [&](double rate) {
    heading += rate * dt;
    const Vector3 earth(omega * std::cos(latitude) * std::cos(heading), -omega * std::cos(latitude) * std::sin(heading),
                        omega * std::sin(latitude));
    const Vector3 w = earth + Vector3(0.0, 0.0, rate) + bias + noise(gyro_asd * std::sqrt(rate_hz));
    const Vector3 f = Vector3(0.0, 0.0, g) + noise(force_sigma);
    input.time_s.push_back(dt * static_cast<double>(input.time_s.size() + 1));
    input.gyro.push_back({w.x(), w.y(), w.z()});
    input.accel.push_back({f.x(), f.y(), f.z()});
  };
  for (int k = 0; k < count; ++k) {
    for (int i = 0; i < static_cast<int>(60.0 * rate_hz); ++i) {
      sample(0.0);
    }
    constexpr double turn_s = 4.0;
    const int n = static_cast<int>(turn_s * rate_hz);
    for (int i = 0; i < n && k + 1 < count; ++i) {
      sample(std::numbers::pi / 2.0 / turn_s * (1.0 - std::cos(2.0 * std::numbers::pi * (i + 0.5) / n)));
    }
  }
  return input;
}

TEST(Headings, FourOfThemGiveTheBias) {
  const Vector3 bias = Vector3(0.4, -0.3, 0.2) * units::degree_per_hour;
  const PoseDiagnosis d = diagnose_poses(headings(bias, 4), 0.01);
  ASSERT_TRUE(d.rest) << d.failure;
  EXPECT_EQ(d.poses, 4);
  ASSERT_TRUE(d.earth_taken_out);
  for (std::size_t k = 0; k < 3; ++k) {
    // White noise of four minutes: 0.01 deg/sqrt(h) in 1/15 h is 0.04 deg/h. The horizontal Earth's rate is 10 deg/h.
    const double off = std::abs(d.gyro_bias.at(k) - bias(static_cast<Eigen::Index>(k))) / units::degree_per_hour;
    EXPECT_LT(off, std::max(5.0 * 0.04, 5.0 * d.gyro_bias_sigma.at(k) / units::degree_per_hour)) << k;
    EXPECT_LT(d.gyro_bias_sigma.at(k) / units::degree_per_hour, 0.2);
  }
  EXPECT_TRUE(std::none_of(d.invisible.begin(), d.invisible.end(), [](const std::string& words) {
    return words.find("bias of the gyros apart from the Earth's rate") != std::string::npos;
  }));
}

TEST(Headings, OneOfThemDoesNot) {
  const PoseDiagnosis d = diagnose_poses(headings(Vector3::Zero(), 1), 0.01);
  ASSERT_TRUE(d.rest) << d.failure;
  EXPECT_FALSE(d.earth_taken_out);
}

// Six faces in files of their own, each at any heading: gaps of a minute between them, and no turn.
PoseInput faces(const Vector3& bias, double told) {
  PoseInput input;
  input.accel_unit = 1.0;
  input.latitude = told;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> any(0.0, 2.0 * std::numbers::pi);
  const auto noise = [&](double sigma) -> Vector3 {
    return sigma * Vector3(normal(random), normal(random), normal(random));
  };
  double t = 0.0;
  for (int face = 0; face < 6; ++face) {
    const Vector3 up = (face % 2 == 0 ? 1.0 : -1.0) * Vector3::Unit(face / 2);
    const Vector3 level = up.unitOrthogonal();
    const double heading = any(random);
    const Vector3 north = std::cos(heading) * level + std::sin(heading) * up.cross(level);
    const Vector3 earth = omega * (std::sin(latitude) * up + std::cos(latitude) * north);
    for (int i = 0; i < static_cast<int>(100.0 * rate_hz); ++i) {
      const Vector3 w = earth + bias + noise(gyro_asd * std::sqrt(rate_hz));
      const Vector3 f = g * up + noise(force_sigma);
      input.time_s.push_back(t += dt);
      input.gyro.push_back({w.x(), w.y(), w.z()});
      input.accel.push_back({f.x(), f.y(), f.z()});
    }
    t += 60.0;
  }
  return input;
}

TEST(Headings, PosesOfAnyHeadingGiveTheBias) {
  const Vector3 bias = Vector3(0.4, -0.3, 0.2) * units::degree_per_hour;
  const PoseDiagnosis d = diagnose_poses(faces(bias, latitude), 0.01);
  ASSERT_TRUE(d.earth_taken_out);
  EXPECT_TRUE(d.gyro_named.empty());
  EXPECT_EQ(d.gyros_contradict, "");
  for (std::size_t k = 0; k < 3; ++k) {
    const double off = std::abs(d.gyro_bias.at(k) - bias(static_cast<Eigen::Index>(k)));
    EXPECT_LT(off, 5.0 * d.gyro_bias_sigma.at(k)) << k;
    // 0.01 deg/sqrt(h) in 100 s is 0.06 deg/h a reading; two of three of six poses are four an axis: 0.03, by nine residuals 0.04.
    EXPECT_LT(d.gyro_bias_sigma.at(k) / units::degree_per_hour, 0.1) << k;
  }
  const PoseDiagnosis elsewhere = diagnose_poses(faces(bias, 20.0 * units::degree), 0.01);
  EXPECT_NE(elsewhere.gyros_contradict.find("latitude 48 deg"), std::string::npos) << elsewhere.gyros_contradict;
}

}  // namespace
}  // namespace selfcal::diagnosis
