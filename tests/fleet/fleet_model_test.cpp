// The fleet's model where its own law holds: what was drawn comes back, by another way of computing it too.
#include "estimator/fleet/fleet_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "estimator/fleet/set_watch.hpp"

namespace selfcal::fleet {
namespace {

constexpr int units = 120, sets = 6, visits = 20;
const double drawn_offsets[sets] = {0.5, -0.3, 0.2, -0.4, 0.1, -0.1};

// By (F1) itself.
std::vector<UnitHistory> drawn(const TypeModel& law, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> where(0, sets - 1);
  std::vector<UnitHistory> fleet;
  for (int u = 0; u < units; ++u) {
    UnitHistory unit;
    double level = law.mean + law.unit_sd * normal(random), year = 3.0;
    const double ramp = law.ramp_per_year + law.ramp_sd * normal(random);
    for (int k = 0; k < visits; ++k) {
      const int set = where(random);
      unit.push_back({set, year, level + drawn_offsets[set] + std::hypot(law.setup_sd, 0.8) * normal(random), 0.8});
      level += 0.4 * ramp + law.walk_sd * std::sqrt(0.4) * normal(random);
      year += 0.4;
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

// The filter's forecast is the conditional mean and variance of one large normal distribution.
TEST(FleetModel, TheFilterIsTheConditionalDistribution) {
  TypeModel law = the_law();
  law.sets.resize(sets);
  const UnitHistory unit = drawn(law, 5).front();
  const Eigen::Index n = static_cast<Eigen::Index>(unit.size());
  const double ahead = unit.back().year + 1.3, first = unit.front().year;
  const auto covariance = [&](double a, double b) {
    const double s = a - first, t = b - first;
    return law.unit_sd * law.unit_sd + law.ramp_sd * law.ramp_sd * s * t + law.walk_sd * law.walk_sd * std::min(s, t);
  };
  Eigen::MatrixXd K(n, n);
  Eigen::VectorXd y(n), k(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Measurement& a = unit[static_cast<std::size_t>(i)];
    y(i) = a.value - law.mean - law.ramp_per_year * (a.year - first);
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
  EXPECT_NEAR(state.level, law.mean + law.ramp_per_year * (ahead - first) + weight.dot(y), 1e-8);
  EXPECT_NEAR(state.covariance[0], covariance(ahead, ahead) - weight.dot(k), 1e-8);
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
