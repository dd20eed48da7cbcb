// Accelerometers in 24 poses by hand whose bias becomes another, and what differs from that.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr int pose_count = 24, rest = 400, move = 200;  // samples of 10 ms
constexpr double gravity = 9.81, mg = 1e-3 * gravity;

// `share` of the log that has passed and the direction of gravity to what the accelerometers read too much, m/s^2.
template <typename Extra>
PoseInput hand_turned(std::uint32_t seed, Extra extra) {
  constexpr double dt = 0.01, gyro_noise = 1e-3, force_noise = 5e-3;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&]() { return Vector3(normal(random), normal(random), normal(random)); };
  PoseInput input;
  input.accel_unit = 1.0;
  input.gravity = gravity;
  Vector3 u(0.0, 0.0, 1.0);
  const auto sample = [&](const Vector3& rate) {
    u = matrix_from_rotation_vector(-rate * dt) * u;
    const auto count = static_cast<double>(input.time_s.size());
    const Vector3 gyro = rate + gyro_noise * draw();
    const Vector3 force = gravity * u + Vector3(0.03, -0.02, 0.01) + extra(count / (pose_count * (rest + move)), u) +
                          force_noise * draw();
    input.time_s.push_back(dt * count);
    input.gyro.push_back({gyro.x(), gyro.y(), gyro.z()});
    input.accel.push_back({force.x(), force.y(), force.z()});
  };
  for (int pose = 0; pose < pose_count; ++pose) {
    for (int k = 0; k < rest; ++k) {
      sample(Vector3::Zero());
    }
    const Vector3 axis = draw().normalized();
    for (int k = 0; k < move; ++k) {
      sample(axis * 0.9 * (1.0 - std::cos(2.0 * M_PI * (k + 0.5) / move)));
    }
  }
  return input;
}

const Vector3 size = Vector3(3.0, -2.0, 2.5) * mg;

TEST(AccelJump, IsToldWhereAndByHowMuch) {
  constexpr int before = 10;  // poses; it jumps in the turn behind them
  constexpr double when = (before - 0.1) / pose_count;
  const PoseInput input =
      hand_turned(1, [](double share, const Vector3&) { return share > when ? size : Vector3(Vector3::Zero()); });
  const PoseDiagnosis d = diagnose_poses(input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_FALSE(d.accel_adequate);
  ASSERT_TRUE(d.accel_jump);
  EXPECT_LE(d.accel_jump->from_pose, before);
  EXPECT_GT(d.accel_jump->to_pose, before);
  EXPECT_LE(d.accel_jump->to_pose - d.accel_jump->from_pose, 2);
  for (Eigen::Index k = 0; k < 3; ++k) {
    // Ten degrees of freedom: beyond six sigma is one draw in seven thousand, and the seed is fixed.
    EXPECT_LT(std::abs(d.accel_jump->size_g(k) - size(k) / gravity), 6.0 * d.accel_jump->sigma_g(k));
    EXPECT_LT(d.accel_jump->sigma_g(k), 0.1 * size.cwiseAbs().minCoeff() / gravity);
    // Nobody says which of the two biases it is: sigma holds both.
    const PoseParameter& bias = d.accel_parameters[static_cast<std::size_t>(k)];
    const double first = Vector3(0.03, -0.02, 0.01)(k);
    EXPECT_LT(std::abs(bias.value - first), 5.0 * bias.sigma) << bias.name;
    EXPECT_LT(std::abs(bias.value - first - size(k)), 5.0 * bias.sigma) << bias.name;
  }
}

TEST(AccelJump, WhatRisesWarmsUpOrGoesWithThePoseIsNone) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const auto none = [seed](const auto& extra, const char* what) {
      EXPECT_FALSE(diagnose_poses(hand_turned(seed, extra), 0.01).accel_jump) << what << ", seed " << seed;
    };
    none([](double share, const Vector3&) { return Vector3(share * size); }, "ramp");
    none([](double share, const Vector3&) { return Vector3((1.0 - std::exp(-5.0 * share)) * size); }, "warm-up");
    none([](double, const Vector3& u) { return Vector3(size.cwiseProduct(u.cwiseAbs2())); }, "square");
    none([](double, const Vector3& u) { return Vector3(size.cwiseProduct(u.cwiseAbs2().cwiseProduct(u))); }, "cubic");
  }
}

TEST(AccelJump, SoundSensorsHaveNone) {
  int told = 0;
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    const PoseInput input = hand_turned(seed, [](double, const Vector3&) { return Vector3(Vector3::Zero()); });
    told += diagnose_poses(input, 0.01).accel_jump ? 1 : 0;
  }
  EXPECT_LE(told, 1);  // at 0.001 each, two and more of forty are one case in a thousand
}

}  // namespace
}  // namespace selfcal::diagnosis
