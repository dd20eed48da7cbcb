// Accelerometers in 24 poses by hand whose bias becomes another, and what differs from that.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/diagnosis/poses/poses.hpp"
#include "tests/unit/diagnosis/accelerometers_by_hand.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr int pose_count = 24;

const Vector3 size = Vector3(3.0, -2.0, 2.5) * test::mg;

TEST(AccelJump, IsToldWhereAndByHowMuch) {
  constexpr int before = 10;  // poses; it jumps in the turn behind them
  constexpr double when = (before - 0.1) / pose_count;
  const PoseInput input = test::hand_turned(
      pose_count, 1, [](double share, const Vector3&) { return share > when ? size : Vector3(Vector3::Zero()); });
  const PoseDiagnosis d = diagnose_poses(input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_FALSE(d.accel_adequate);
  ASSERT_TRUE(d.accel_jump);
  EXPECT_LE(d.accel_jump->from_pose, before);
  EXPECT_GT(d.accel_jump->to_pose, before);
  EXPECT_LE(d.accel_jump->to_pose - d.accel_jump->from_pose, 2);
  for (Eigen::Index k = 0; k < 3; ++k) {
    // Ten degrees of freedom: beyond six sigma is one draw in seven thousand, and the seed is fixed.
    EXPECT_LT(std::abs(d.accel_jump->size_g(k) - size(k) / test::gravity), 6.0 * d.accel_jump->sigma_g(k));
    EXPECT_LT(d.accel_jump->sigma_g(k), 0.1 * size.cwiseAbs().minCoeff() / test::gravity);
    // Nobody says which of the two biases it is: sigma holds both.
    const PoseParameter& bias = d.accel_parameters[static_cast<std::size_t>(k)];
    const double first = Vector3(0.03, -0.02, 0.01)(k);
    EXPECT_LT(std::abs(bias.value - first), 5.0 * bias.sigma) << bias.name;
    EXPECT_LT(std::abs(bias.value - first - size(k)), 5.0 * bias.sigma) << bias.name;
  }
}

// What a jump leaves beside the nine widens their sigma: that is no reason to ask nothing.
TEST(AccelJump, IsToldHoweverLargeItIs) {
  constexpr int before = 14;
  constexpr double when = (before - 0.1) / pose_count;
  for (const double times : {0.3, 1.0, 3.0, 10.0}) {
    for (std::uint32_t seed = 1; seed <= 4; ++seed) {
      const PoseDiagnosis d =
          diagnose_poses(test::hand_turned(pose_count, seed,
                                           [times](double share, const Vector3&) {
                                             return share > when ? Vector3(times * size) : Vector3(Vector3::Zero());
                                           }),
                         0.01);
      ASSERT_TRUE(d.accel_jump) << times << " times, seed " << seed;
      EXPECT_LE(d.accel_jump->from_pose, before);
      EXPECT_GT(d.accel_jump->to_pose, before);
    }
  }
}

TEST(AccelJump, WhatRisesWarmsUpOrGoesWithThePoseIsNone) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const auto none = [seed](const auto& extra, const char* what) {
      EXPECT_FALSE(diagnose_poses(test::hand_turned(pose_count, seed, extra), 0.01).accel_jump)
          << what << ", seed " << seed;
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
    const PoseInput input =
        test::hand_turned(pose_count, seed, [](double, const Vector3&) { return Vector3(Vector3::Zero()); });
    told += diagnose_poses(input, 0.01).accel_jump ? 1 : 0;
  }
  EXPECT_LE(told, 1);  // at 0.001 each, two and more of forty are one case in a thousand
}

}  // namespace
}  // namespace selfcal::diagnosis
