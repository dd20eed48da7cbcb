// What a turn leaves behind, against integrals done by hand.
#include "estimator/diagnosis/effects/turn_memory.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace selfcal::diagnosis {
namespace {

constexpr double tau = 30.0;
const Vector3 step(1.0, -2.0, 0.5);

TEST(TurnMemory, IsZeroBeforeTheFirstTurn) {
  const TurnMemory memory({{100.0, 0.1, {step}}});
  EXPECT_EQ(memory.integral(0.0, 100.0, tau).norm(), 0.0);
  EXPECT_EQ(TurnMemory({}).integral(0.0, 100.0, tau).norm(), 0.0);
}

// int_a^b d exp(-(s - 100)/tau) ds = d tau (exp(-(a - 100)/tau) - exp(-(b - 100)/tau)).
TEST(TurnMemory, OfOneJumpDecays) {
  const TurnMemory memory({{100.0, 0.1, {step}}});
  const auto closed = [](double a, double b) {
    return Vector3(step * tau * (std::exp(-(a - 100.0) / tau) - std::exp(-(b - 100.0) / tau)));
  };
  EXPECT_NEAR((memory.integral(110.0, 111.0, tau) - closed(110.0, 111.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((memory.integral(90.0, 111.0, tau) - closed(100.0, 111.0)).norm(), 0.0, 1e-12);  // holds the jump
  EXPECT_NEAR((memory.integral(100.05, 130.0, tau) - closed(100.05, 130.0)).norm(), 0.0,
              1e-12);  // begins within the piece
}

// A ramp of 10 s in pieces of 0.1 s: y = r tau (1 - exp(-s/tau)) at its end, which a jump in the middle of each piece makes to
// (0.1/tau)^2/24 of itself.
TEST(TurnMemory, OfARampIsThatOfItsLag) {
  const Vector3 rate(0.1, 0.0, -0.3);  // a second
  TurnChanges ramp{50.05, 0.1, {}};
  for (int k = 0; k < 100; ++k) {
    ramp.change.emplace_back(0.1 * rate);
  }
  const TurnMemory memory({ramp});
  const Vector3 at_end = rate * tau * (1.0 - std::exp(-10.0 / tau));
  for (const double s : {0.06, 1.0, 20.0, 200.0}) {
    const Vector3 closed = at_end * tau * (std::exp(-s / tau) - std::exp(-(s + 1.0) / tau));
    EXPECT_NEAR((memory.integral(60.0 + s, 61.0 + s, tau) - closed).norm(), 0.0, 1e-6 * closed.norm()) << s;
  }
}

TEST(TurnMemory, OfSeveralTurnsIsTheirSum) {
  const TurnChanges one{10.0, 0.1, {step, step}}, two{80.0, 0.2, {-step, Vector3::UnitX()}};
  const Vector3 sum = TurnMemory({one}).integral(85.0, 90.0, tau) + TurnMemory({two}).integral(85.0, 90.0, tau);
  EXPECT_NEAR((TurnMemory({one, two}).integral(85.0, 90.0, tau) - sum).norm(), 0.0, 1e-12);
  // Stretches that share an end make one, wherever the end falls.
  const TurnMemory memory({one, two});
  for (const double cut : {10.05, 60.0, 80.1, 85.0}) {
    EXPECT_NEAR(
        (memory.integral(5.0, cut, tau) + memory.integral(cut, 90.0, tau) - memory.integral(5.0, 90.0, tau)).norm(),
        0.0, 1e-12)
        << cut;
  }
}

// However many time constants are asked for in between: each has its own past.
TEST(TurnMemory, OfManyTimeConstantsEachIsItsOwn) {
  const TurnMemory memory({{100.0, 0.1, {step, step}}, {200.0, 0.1, {-step}}});
  for (int round = 0; round < 2; ++round) {
    for (int k = 1; k <= 50; ++k) {
      const double tau_s = 3.0 * k;
      const auto left = [&](double since_s) { return std::exp(-since_s / tau_s); };
      const double closed = tau_s * (left(150.0) - left(151.0) + left(149.9) - left(150.9) - left(50.0) + left(51.0));
      EXPECT_NEAR((memory.integral(250.0, 251.0, tau_s) - step * closed).norm(), 0.0, 1e-12) << tau_s;
    }
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
