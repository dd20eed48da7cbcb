// A walk by jumps: told from a normal one, and what it means for the time until a limit is left.
#include "estimator/fleet/jumps.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/fleet/interval.hpp"

namespace selfcal::fleet {
namespace {

constexpr double jumps_per_year = 0.5, jump_sd = 2.0, sigma = 0.8;

TypeModel a_walk() {
  TypeModel law;
  law.unit_sd = 10.0;
  law.walk_sd = std::sqrt(jumps_per_year) * jump_sd;
  law.sets.resize(1);
  return law;
}

// 300 units over 8 years, a calibration each tenth of a year.
std::vector<UnitHistory> drawn(const TypeModel& law, bool by_jumps, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::poisson_distribution<int> count(0.1 * jumps_per_year);
  std::vector<UnitHistory> fleet(300);
  for (UnitHistory& unit : fleet) {
    double level = law.unit_sd * normal(random);
    for (int k = 0; k < 80; ++k) {
      unit.push_back({0, 0.1 * k, level + sigma * normal(random), sigma});
      const double step = by_jumps ? jump_sd * std::sqrt(count(random)) : law.walk_sd * std::sqrt(0.1);
      level += step * normal(random);
    }
  }
  return fleet;
}

// With 8 years of 300 units some 1200 jumps are seen: their mean fourth power, 3 s^4 with a scatter of sqrt(96) s^4, is known to 10 %
// and s to 5 %; noise takes as much again. Four of these, and the sigma that the answer lies above: 5 %.
TEST(Jumps, ComeBack) {
  const TypeModel law = a_walk();
  const Jumps found = jumps_of(drawn(law, true, 5), law);
  EXPECT_NEAR(found.sd, 1.05 * jump_sd, 4 * 0.07 * jump_sd);
  EXPECT_NEAR(found.per_year * found.sd * found.sd, law.walk_sd * law.walk_sd, 1e-9);
}

// Four sigma of twenty fleets: one in 1600 would be told by chance.
TEST(Jumps, AreNotToldOfANormalWalk) {
  const TypeModel law = a_walk();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_EQ(jumps_of(drawn(law, false, seed), law).per_year, 0.0) << "seed " << seed;
  }
  EXPECT_EQ(jumps_of({}, law).per_year, 0.0);
}

// Of 20,000 units that start where they are known, how many pass the limit within the years; exact, for they move by jumps alone.
int left_within(double years, double limit) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::exponential_distribution<double> until_next(jumps_per_year);
  int left = 0;
  for (int unit = 0; unit < 20'000; ++unit) {
    double level = 0.0;
    for (double year = until_next(random); year < years && std::abs(level) <= limit; year += until_next(random)) {
      level += jump_sd * normal(random);
    }
    left += std::abs(level) > limit ? 1 : 0;
  }
  return left;
}

// 1 % of 20,000: 200 +- 14. The rate counts a path that comes back and leaves again more than once, so that fewer leave; not fewer
// than half. Control: the same walk taken for normal gives an interval in which more leave.
TEST(Jumps, SoManyLeaveWithinTheInterval) {
  TypeModel law = a_walk();
  law.unit_sd = 0.0;
  const double limit = 7.0;
  const auto interval = [&] {
    const UnitFilter filter(law, 0.0);
    const Watched one{&filter, 0.0, limit};
    return interval_years({&one, 1}, 0.0, 0.01, 0.1, 20.0);
  };
  const double as_normal = interval();
  law.jumps_per_year = jumps_per_year;
  law.jump_sd = jump_sd;
  const double by_jumps = interval();
  EXPECT_LT(by_jumps, as_normal);
  EXPECT_LT(left_within(by_jumps, limit), 200 + 3 * 14);
  EXPECT_GT(left_within(by_jumps, limit), 100);
  EXPECT_GT(left_within(as_normal, limit), 200 + 3 * 14);
}

}  // namespace
}  // namespace selfcal::fleet
