// Moves that are told one by one: the samples are those of moves that were known from the beginning.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/geometry/units.hpp"
#include "sim_ins/device/commanded_gimbal.hpp"

namespace selfcal::sim {
namespace {

constexpr double quarter = 90.0 * units::degree;
constexpr double step_s = 0.1;

SimConfig exact() {
  SimConfig config;
  config.gimbal.positioning_error_deg = 0.0;
  return config;
}

TEST(CommandedGimbal, GivesTheSamplesOfTheWholeMotion) {
  ConcealedPhysics physics;
  physics.effects.push_back(
      {"accel_relaxation", {50.0 * 9.80665e-6, 0.0, 0.0, 60.0}});  // x y z, tau: it knows the moves
  physics.effects.push_back(
      {"accel_load_lag", {0.0, 0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 5.0}});  // and the load before each
  physics.effects.push_back({"gyro_turn_heat", {0.0, 0.0, 1e-5, 5.0}});
  CommandedGimbal gimbal(exact(), 3, physics, {});
  gimbal.power_on(0.0);
  ASSERT_TRUE(gimbal.start(10.0));
  std::vector<ImuSample> told;
  for (int k = 0; k <= 160; ++k) {
    const double now_s = 10.0 + step_s * k;
    if (k == 20 || k == 90) {
      gimbal.turn_to(k == 20 ? std::array{quarter, 0.0} : std::array{quarter, quarter}, now_s);
    }
    for (const ImuSample& sample : gimbal.take(now_s)) {
      told.push_back(sample);
    }
  }
  // Each move begins where the samples stood.
  const double rate = exact().sample_rate_hz;
  const double first_s = 2.0, second_s = 9.0;
  const GimbalMotion whole({0.0, 0.0}, {{first_s, 5.0, 1.5, {0.0, 0.0}, {quarter, 0.0}},
                                        {second_s, 5.0, 1.5, {quarter, 0.0}, {quarter, quarter}}});
  auto known = ImuSimulator::create(exact(), whole, 3, physics);
  ASSERT_TRUE(known);
  ASSERT_GE(told.size(), static_cast<std::size_t>(15.9 * rate));
  int turning = 0;
  for (const ImuSample& sample : told) {
    const ImuSample wanted = known->next();
    ASSERT_NEAR(sample.outer, wanted.outer, 1e-9);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // The move's start is rounded to its last bit: a count may fall to the other side.
      ASSERT_LE(std::abs(sample.delta_theta[axis] - wanted.delta_theta[axis]), 1);
      ASSERT_LE(std::abs(sample.delta_v[axis] - wanted.delta_v[axis]), 1);
    }
    turning += std::abs(wanted.delta_theta[2]) > 1000 ? 1 : 0;
  }
  EXPECT_GT(turning, 2 * rate);  // the control: it did turn
  EXPECT_NEAR(gimbal.angles(26.0)[0], quarter, 1e-12);
  EXPECT_NEAR(gimbal.angles(26.0)[1], quarter, 1e-12);
}

TEST(CommandedGimbal, DoesNotHearAMoveWhileItTurns) {
  CommandedGimbal gimbal(exact(), 3, {}, {});
  gimbal.power_on(0.0);
  gimbal.turn_to({quarter, 0.0}, 1.0);
  EXPECT_TRUE(gimbal.turning(2.0));
  gimbal.turn_to({0.0, quarter}, 2.0);
  EXPECT_FALSE(gimbal.turning(6.5));
  EXPECT_NEAR(gimbal.angles(6.5)[0], quarter, 1e-12);
  EXPECT_NEAR(gimbal.angles(6.5)[1], 0.0, 1e-12);
  EXPECT_TRUE(gimbal.take(6.5).empty());  // no samples before start()
}

// 180 deg in 5 s would need more than the drive has.
TEST(CommandedGimbal, TakesLongerWhereTheDriveNeedsIt) {
  CommandedGimbal gimbal(exact(), 3, {}, {});
  gimbal.power_on(0.0);
  gimbal.turn_to({2.0 * quarter, 0.0}, 0.0);
  EXPECT_TRUE(gimbal.turning(5.5));
  EXPECT_FALSE(gimbal.turning(10.5));
  EXPECT_NEAR(gimbal.angles(10.5)[0], 2.0 * quarter, 1e-12);
}

}  // namespace
}  // namespace selfcal::sim
