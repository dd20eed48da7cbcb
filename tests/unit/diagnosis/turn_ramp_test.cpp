// How a gimbal turns, found in a recording and carried to rotations that it has not made.
#include "estimator/diagnosis/turn_ramp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double turn_s = 5.0, rate_hz = 50.0;

Schedule four_turns() {
  Schedule schedule;
  schedule.positions = {{0.0, 0.0}, {90.0, 0.0}, {90.0, 90.0}, {0.0, 90.0}, {0.0, 0.0}};
  schedule.dwell_s.assign(5, 20.0);
  schedule.rotation_s = turn_s;
  return schedule;
}

IdealRecording recording(double ramp) { return {four_turns(), {}, {0.8, 0.0, 0.0}, rate_hz, ramp}; }

class TurnRamp : public testing::TestWithParam<double> {};

TEST_P(TurnRamp, IsFoundInTheRecording) { EXPECT_NEAR(turn_ramp(recording(GetParam()).data()), GetParam(), 0.03); }

// A ramp holds half of the angle that the steady rate holds in its time, so that this is 90 deg in (1 - ramp) of the turn.
TEST_P(TurnRamp, LeavesTheSteadyRateThatTheAngleNeeds) {
  const IdealRecording made = recording(GetParam());
  double fastest = 0.0, way = 0.0;
  for (std::size_t k = 1; k < made.data().size(); ++k) {
    const double step = made.data().gimbal_outer[k] - made.data().gimbal_outer[k - 1];
    fastest = std::max(fastest, std::abs(step) * rate_hz);
    way += std::abs(step);
  }
  EXPECT_NEAR(fastest / units::degree, 90.0 / turn_s / (1.0 - GetParam()), 0.1);
  EXPECT_NEAR(way / units::degree, 180.0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Ramps, TurnRamp, testing::Values(0.05, 0.1, 0.27, 0.4, 0.5));

TEST(TurnRampOfNothing, IsThatOfATurnWithoutASteadyRate) {
  Schedule still = four_turns();
  still.positions.assign(5, {0.0, 0.0});
  const IdealRecording made(still, {}, {0.8, 0.0, 0.0}, rate_hz);
  EXPECT_DOUBLE_EQ(turn_ramp(made.data()), 0.5);
}

}  // namespace
}  // namespace selfcal::diagnosis
