// The fleet's model where its own law holds: what was drawn comes back, by another way of computing it too.
#include "estimator/fleet/fleet_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "estimator/fleet/interval.hpp"
#include "estimator/fleet/set_watch.hpp"

namespace selfcal::fleet {
namespace {

constexpr int units = 120, sets = 6, visits = 20;
const double drawn_offsets[sets] = {0.5, -0.3, 0.2, -0.4, 0.1, -0.1};

// The value of one unit by (F1) and (F2) themselves, exact for any step.
class DrawnUnit {
 public:
  DrawnUnit(const TypeModel& law, std::mt19937_64& random) : law_(law), random_(random) {
    level_ = law.mean + law.unit_sd * normal_(random);
    ramp_ = law.ramp_per_year + law.ramp_sd * normal_(random);
    returning_ = law.settling + law.settling_sd * normal_(random);
  }
  double value() const { return level_ + returning_; }
  void advance(double years) {
    const double kept = law_.return_years > 0.0 ? std::exp(-years / law_.return_years) : 0.0;
    level_ += years * ramp_ + law_.walk_sd * std::sqrt(years) * normal_(random_);
    returning_ = kept * returning_ + law_.wander_sd * std::sqrt(1.0 - kept * kept) * normal_(random_);
  }

 private:
  const TypeModel& law_;
  std::mt19937_64& random_;
  std::normal_distribution<double> normal_;
  double level_, ramp_, returning_;
};

std::vector<UnitHistory> drawn(const TypeModel& law, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> where(0, sets - 1);
  std::vector<UnitHistory> fleet;
  for (int u = 0; u < units; ++u) {
    UnitHistory unit;
    DrawnUnit truth(law, random);
    for (int k = 0; k < visits; ++k) {
      const int set = where(random);
      unit.push_back({set, 3.0 + 0.4 * k,
                      truth.value() + drawn_offsets[set] + std::hypot(law.setup_sd, 0.8) * normal(random), 0.8});
      truth.advance(0.4);
    }
    fleet.push_back(std::move(unit));
  }
  return fleet;
}

TypeModel the_law() {
  TypeModel law;
  law.mean = 50.0;
  law.ramp_per_year = 1.5;
  law.unit_sd = 10.0;
  law.ramp_sd = 0.8;
  law.walk_sd = 1.2;
  law.setup_sd = 0.9;
  return law;
}

// New units stand 6 below where they will stay, and old ones wander about it.
TypeModel a_law_that_returns() {
  TypeModel law;
  law.mean = 50.0;
  law.unit_sd = 10.0;
  law.setup_sd = 0.9;
  law.settling = -6.0;
  law.settling_sd = 2.0;
  law.wander_sd = 1.5;
  law.return_years = 2.0;
  return law;
}

TEST(FleetModel, WhatWasDrawnComesBack) {
  const TypeModel law = the_law();
  const TypeModel found = fit_type(drawn(law, 11), sets);
  // Sigmas of what 120 units tell: of the mean 10/sqrt(120) = 0.9, of the ramp sqrt(0.8^2 + 1.2^2/7.6)/sqrt(120) = 0.08; of a
  // standard deviation between units 1/sqrt(240) of it, 6.5 %, and more where another variance hides it. Four of them each.
  EXPECT_NEAR(found.mean, law.mean, 3.7);
  EXPECT_NEAR(found.ramp_per_year, law.ramp_per_year, 0.35);
  EXPECT_NEAR(found.unit_sd, law.unit_sd, 0.26 * law.unit_sd);
  EXPECT_NEAR(found.ramp_sd, law.ramp_sd, 0.4 * law.ramp_sd);
  // 2280 steps tell both, against each other.
  EXPECT_NEAR(found.walk_sd, law.walk_sd, 0.15 * law.walk_sd);
  EXPECT_NEAR(found.setup_sd, law.setup_sd, 0.15 * law.setup_sd);
  for (int s = 0; s < sets; ++s) {
    const SetOffset& offset = found.sets[static_cast<std::size_t>(s)];
    EXPECT_NEAR(offset.value, drawn_offsets[s], 4.0 * offset.sigma + 0.05) << s;
    EXPECT_LT(offset.sigma, 0.3);
    EXPECT_GT(offset.measurements, units * visits / sets / 2);
  }
}

// What comes back is told from a walk. Sigmas: of v0 sqrt(2^2 + 1.5^2 + 1.2^2)/sqrt(120) = 0.25 and as much again for T; of T and
// wander_sd, which trade against the walk, some 15 %. Four of each.
TEST(FleetModel, WhatComesBackIsTold) {
  const TypeModel law = a_law_that_returns();
  const TypeModel found = fit_type(drawn(law, 21), sets);
  EXPECT_NEAR(found.settling, law.settling, 2.0);
  EXPECT_NEAR(found.settling_sd, law.settling_sd, 1.2);
  EXPECT_NEAR(found.wander_sd, law.wander_sd, 0.9);
  EXPECT_GT(found.return_years, 0.8);
  EXPECT_LT(found.return_years, 5.0);
  EXPECT_LT(found.walk_sd, 0.7);  // without v it stands for all: sqrt(2 * 1.5^2 / 2) = 1.5 a square root of a year
}

// The filter's forecast is the conditional mean and variance of one large normal distribution.
TEST(FleetModel, TheFilterIsTheConditionalDistribution) {
  TypeModel law = the_law();
  law.settling = -3.0;
  law.settling_sd = 1.5;
  law.wander_sd = 1.1;
  law.return_years = 2.0;
  law.sets.resize(sets);
  const UnitHistory unit = drawn(law, 5).front();
  const Eigen::Index n = static_cast<Eigen::Index>(unit.size());
  const double ahead = unit.back().year + 1.3, first = unit.front().year;
  const auto covariance = [&](double a, double b) {
    const double s = a - first, t = b - first;
    const double kept = std::exp(-std::min(s, t) / law.return_years),
                 since = std::exp(-std::abs(s - t) / law.return_years);
    return law.unit_sd * law.unit_sd + law.ramp_sd * law.ramp_sd * s * t + law.walk_sd * law.walk_sd * std::min(s, t) +
           since * (std::pow(law.settling_sd * kept, 2) + std::pow(law.wander_sd, 2) * (1.0 - kept * kept));
  };
  const auto mean = [&](double year) {
    return law.mean + law.ramp_per_year * (year - first) + law.settling * std::exp(-(year - first) / law.return_years);
  };
  Eigen::MatrixXd K(n, n);
  Eigen::VectorXd y(n), k(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Measurement& a = unit[static_cast<std::size_t>(i)];
    y(i) = a.value - mean(a.year);
    k(i) = covariance(a.year, ahead);
    for (Eigen::Index j = 0; j < n; ++j) {
      K(i, j) = covariance(a.year, unit[static_cast<std::size_t>(j)].year);
    }
    K(i, i) += a.sigma * a.sigma + law.setup_sd * law.setup_sd;
  }
  const Eigen::VectorXd weight = K.ldlt().solve(k);
  UnitFilter filter(law, first);
  for (const Measurement& m : unit) {
    filter.add(m);
  }
  const UnitState state = filter.at(ahead);
  // Rounding of a 20 x 20 solution whose condition is some 1e4.
  EXPECT_NEAR(state.value(), mean(ahead) + weight.dot(y), 1e-8);
  EXPECT_NEAR(state.covariance.variance(), covariance(ahead, ahead) - weight.dot(k), 1e-8);
}

TEST(FleetModel, TooLittleIsNoModel) {
  const TypeModel none = fit_type({}, 3);
  EXPECT_EQ(none.sets.size(), 3u);
  EXPECT_EQ(none.unit_sd, 0.0);
  const std::vector<UnitHistory> two{{{0, 0.0, 1.0, 0.1}, {1, 1.0, 2.0, 0.1}}, {{0, 0.0, 5.0, 0.1}}};
  const TypeModel little = fit_type(two, 3);
  EXPECT_GT(little.unit_sd, 1.0);
  EXPECT_EQ(little.walk_sd, 0.0);
  const std::vector<UnitHistory> same(20, UnitHistory{{0, 0.0, 4.0, 0.1}, {0, 1.0, 4.0, 0.1}});
  EXPECT_EQ(fit_type(same, 1).mean, 4.0);
}

// A walk of 1 a square root of a year known exactly at the start: it leaves 3 within t with probability 2 * 2 * Phi(-3/sqrt(t)) by
// reflection; that is 0.01 at t = 1.14.
TEST(FleetModel, AnIntervalEndsWhereTheRiskIsReached) {
  TypeModel law;
  law.walk_sd = 1.0;
  const UnitFilter filter(law, 0.0);
  const Watched one{&filter, 0.0, 3.0};
  const double years = interval_years({&one, 1}, 0.0, 0.01, 0.1, 5.0);
  EXPECT_NEAR(years, 1.14, 0.03);  // the grid is a week
  const std::vector<Watched> two(2, one);
  EXPECT_LT(interval_years(two, 0.0, 0.01, 0.1, 5.0), years);
  const Watched unlimited{&filter, 0.0, 0.0};
  EXPECT_EQ(interval_years({&unlimited, 1}, 0.0, 0.01, 0.1, 5.0), 5.0);
  const Watched off{&filter, 2.9, 3.0};  // compensated by a value that was wrong already
  EXPECT_LT(interval_years({&off, 1}, 0.0, 0.01, 0.1, 5.0), 0.5);
}

// 4000 units from where they are known, looked at every day: 5 % are asked for, 200 +- 14. The rate counts a path that comes
// back and leaves again more than once, so that fewer leave; not fewer than half.
TEST(FleetModel, SoManyLeaveWithinTheInterval) {
  TypeModel law;
  law.ramp_sd = 0.5;
  law.walk_sd = 0.3;
  law.settling = -2.0;
  law.wander_sd = 1.0;
  law.return_years = 1.5;
  const UnitFilter filter(law, 0.0);
  const double limit = 3.0, measured = law.settling;
  const Watched one{&filter, measured, limit};
  const double years = interval_years({&one, 1}, 0.0, 0.05, 0.1, 5.0);
  ASSERT_GT(years, 0.3);
  ASSERT_LT(years, 4.0);
  std::mt19937_64 random(8);
  int left = 0;
  for (int unit = 0; unit < 4000; ++unit) {
    DrawnUnit truth(law, random);
    bool beyond = false;
    for (double year = 0.0; year < years && !beyond; year += 1.0 / 365.0) {
      truth.advance(1.0 / 365.0);
      beyond = std::abs(truth.value() - measured) > limit;
    }
    left += beyond ? 1 : 0;
  }
  EXPECT_LT(left, 200 + 3 * 14);
  EXPECT_GT(left, 100);
}

// Ten units that differ the same way accuse; one unit that differs ten times does not.
TEST(SetWatch, ASetShowsInManyUnits) {
  const SetOffset known{0.0, 0.1, 1000};
  SetWatch set(known), unit(known);
  SetVerdict of_many, of_one;
  for (int k = 0; k < units_in_window; ++k) {
    of_many = set.add(k, {2.0, 1.0});
    of_one = unit.add(7, {2.0, 1.0});
    EXPECT_EQ(of_many.z == 0.0, k + 1 < least_units);
  }
  // 2 by sqrt(1/10 + 0.1^2)
  EXPECT_NEAR(of_many.z, 2.0 / std::sqrt(0.11), 1e-12);
  EXPECT_GT(of_many.z, accusation_limit(0.01, 24, 250));
  EXPECT_EQ(of_one.z, 0.0);
  EXPECT_EQ(of_one.units, 1);
}

// 4000 sound sets that measure pure noise 250 times: 1 % are accused, known to sqrt(40)/4000 = 0.16 %. The formula is an
// approximation from above by its sum over windows; four sigma and a third of itself are allowed.
TEST(SetWatch, ASoundSetIsAccusedAsSeldomAsAsked) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const double limit = accusation_limit(0.01, 1, 250);
  int accused = 0;
  for (int s = 0; s < 4000; ++s) {
    SetWatch watch(SetOffset{0.0, 0.0, 0});
    bool beyond = false;
    for (int k = 0; k < 250; ++k) {
      beyond = beyond || std::abs(watch.add(k, {normal(random), 1.0}).z) > limit;
    }
    accused += beyond ? 1 : 0;
  }
  EXPECT_GT(accused, 10);
  EXPECT_LT(accused, 40 + 26 + 13);
}

}  // namespace
}  // namespace selfcal::fleet
