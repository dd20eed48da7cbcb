// The memory of load and of turns in the simulation, against its differential equation and closed forms.
#include "sim_ins/turn_memory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/geometry/units.hpp"

namespace selfcal::sim {
namespace {

constexpr double quarter = 90.0 * units::degree;
constexpr double tau = 20.0;

// Turns of a quarter at 10 and 40 s, 5 s each.
TrueMotion two_turns(BaseMotion base = {}) {
  GimbalMotion gimbal(
      {0.0, 0.0}, {{10.0, 5.0, 1.5, {0.0, 0.0}, {0.0, quarter}}, {40.0, 5.0, 1.5, {0.0, quarter}, {quarter, quarter}}});
  return {{0.8, 0.0, 0.0}, {0.02, -0.05, 0.4}, std::move(base), std::move(gimbal)};
}

// Euler's method in steps of 1 ms: its error is of order 1 ms/tau.
TEST(TurnMemory, OfTheLoadIsItsLagLessItself) {
  const TrueMotion motion = two_turns();
  TurnMemory memory(TurnMemory::Of::load, tau);
  constexpr double h = 1e-3;
  Vector3 lagging = motion.at(0.0).f_ib_b / units::standard_gravity;
  for (int k = 0; k <= 60000; ++k) {
    const double t = h * k;
    const Vector3 u = motion.at(t).f_ib_b / units::standard_gravity;
    if (k % 2500 == 0) {
      EXPECT_NEAR((memory.at(t, motion) - (lagging - u)).norm(), 0.0, 1e-4) << t;
    }
    lagging += h * (u - lagging) / tau;
  }
  EXPECT_GT(memory.at(46.0, motion).norm(), 0.5);  // the control: something was turned
}

// Long after a turn of a quarter: 90 deg of it, spread over 5 s evenly about its middle, (5/tau)^2/24 at most beside it.
TEST(TurnMemory, OfTheTravelIsTheAngleThatFades) {
  const TrueMotion motion = two_turns();
  TurnMemory memory(TurnMemory::Of::travel, tau);
  EXPECT_EQ(memory.at(9.9, motion).x(), 0.0);
  EXPECT_NEAR(memory.at(35.0, motion).x() / (quarter * std::exp(-22.5 / tau)), 1.0, 3e-3);
  EXPECT_NEAR(memory.at(80.0, motion).x() / (quarter * (std::exp(-67.5 / tau) + std::exp(-37.5 / tau))), 1.0, 3e-3);
}

// A base that rolls by 1 deg in 10 s: the lag of a sine is the sine over sqrt(1 + (w tau)^2), so that the memory is nearly -u.
TEST(TurnMemory, OfASwayingBaseIsThatOfASine) {
  BaseMotion base;
  base.roll.push_back({1.0 * units::degree, 10.0, 0.0});
  const TrueMotion motion = two_turns(std::move(base));
  TurnMemory memory(TurnMemory::Of::load, tau);
  const double w_tau = 2.0 * std::numbers::pi / 10.0 * tau;
  const Vector3 u0 = motion.at(400.0).f_ib_b / units::standard_gravity;  // the sine's zero: long after the turns
  const Vector3 amplitude = motion.at(402.5).f_ib_b / units::standard_gravity - u0;
  // -u + lag(u) at the crest: -a (1 - 1/(1 + (w tau)^2)).
  const Vector3 wanted = -amplitude * (1.0 - 1.0 / (1.0 + w_tau * w_tau));
  EXPECT_GT(amplitude.norm(), 0.01);
  EXPECT_NEAR((memory.at(402.5, motion) - wanted).norm(), 0.0, 0.02 * amplitude.norm());
}

}  // namespace
}  // namespace selfcal::sim
