// The search's decisions on models of a few columns.
#include "estimator/diagnosis/search/selection.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/diagnosis/linear.hpp"

namespace selfcal::diagnosis {
namespace {

const Effect a = one_coefficient("a"), b = one_coefficient("b"), c = one_coefficient("c");
const Candidate column_a{&a, NAN, 0, 1}, column_b{&b, NAN, 1, 1}, column_c{&c, NAN, 2, 1};
const std::vector<Candidate> all = {column_a, column_b, column_c};
constexpr double length = 10.0;

bool never(const BiasProcess& /*process*/) {
  ADD_FAILURE() << "asked where nothing hangs on it";
  return false;
}

Significance with_threshold(double log_threshold, double tests = 5.0) { return {log_threshold, tests, 3000.0}; }

// a and b with this cosine between them, c at right angles to both; the data are one a.
Evidence one_a(double cosine) {
  Eigen::MatrixXd columns(3, 3);
  columns << at_angle(length, 1.0, 3), at_angle(length, cosine, 3), length * Eigen::Vector3d::UnitZ();
  return evidence_of(columns, columns.col(0));
}

// Three columns at right angles, sizes 1, 2 and 0: gains 100, 400 and 0.
Evidence at_right_angles() {
  return evidence_of(length * Eigen::Matrix3d::Identity(), length * Eigen::Vector3d(1.0, 2.0, 0.0));
}

TEST(BestAddition, IsWhatGainsMostOnceItIsSignificantAmongAllThatWereTried) {
  const double corrected = log_chi_squared_tail(400.0, 1.0) + std::log(5.0);
  const auto found = best_addition(at_right_angles(), {}, all, {}, with_threshold(corrected + 1e-9), never);
  ASSERT_TRUE(found && found->term);
  EXPECT_EQ(found->term->effect, &b);
  EXPECT_FALSE(best_addition(at_right_angles(), {}, all, {}, with_threshold(corrected - 1e-9), never));
}

// Given b, a is what is left, and given both nothing.
TEST(BestAddition, IsJudgedGivenWhatIsFitted) {
  const auto found = best_addition(at_right_angles(), {1}, all, {}, with_threshold(-10.0), never);
  ASSERT_TRUE(found && found->term);
  EXPECT_EQ(found->term->effect, &a);
  EXPECT_FALSE(best_addition(at_right_angles(), {0, 1}, {column_c}, {}, with_threshold(-10.0), never));
}

// The line of a spectrum was looked for at a sixth of the rows' number of frequencies.
TEST(BestAddition, OfASpectrumIsCorrectedForItsFrequencies) {
  Effect line = a;
  line.constant.kind = EffectConstant::Kind::spectrum;
  const Significance s = with_threshold(-10.0);
  EXPECT_NEAR(s.corrected(-30.0, line) - s.corrected(-30.0, a), std::log(3000.0 / 6.0), 1e-12);
}

// Log p of 50 and 70 with one degree are -26.7 and -36.9: a share of 0.72, between what an equation must have against a walk
// (0.85) and against jumps (0.6).
TEST(BestAddition, IsAnEquationBeforeAWalkThatJumpsButNotBeforeOneThatWalks) {
  const Evidence e = evidence_of(length * Eigen::Matrix3d::Identity(), std::sqrt(50.0) * Eigen::Vector3d::UnitX());
  BiasProcess process;
  process.axes = {3};
  process.delta_chi2 = 70.0;
  const double share = log_chi_squared_tail(50.0, 1.0) / log_chi_squared_tail(70.0, 1.0);
  ASSERT_GT(share, 0.6);
  ASSERT_LT(share, 0.85);
  for (const bool processes : {true, false}) {
    const auto goes_on = [&](const BiasProcess&) { return processes; };
    const auto found = best_addition(e, {}, all, {process}, with_threshold(-10.0), goes_on);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->process.has_value(), processes);
    EXPECT_EQ(found->term.has_value(), !processes);
  }
}

// Beside a, b at cosine k adds nothing; beside b, a keeps Δχ² 100 (1 - k^2). At k = 0.9 that is 19, log p -11.4 and
// corrected -9.8: a stays and b is weak. At 0.999 it is 0.2, and the first of the twins is.
TEST(WeakTerm, OfACollinearPairIsTheOneThatTheOtherStandsFor) {
  EXPECT_EQ(weak_term(one_a(0.9), {column_a, column_b}, with_threshold(-9.0)), 1U);
  EXPECT_EQ(weak_term(one_a(0.999), {column_a, column_b}, with_threshold(-9.0)), 0U);
  EXPECT_FALSE(weak_term(one_a(0.9), {column_a}, with_threshold(-9.0)));
}

// In the place of a, b gains 100 k^2: at 0.9, log p -42.6 for -52.1.
TEST(BetterExchange, TakesTheTrueTermForItsTwin) {
  const auto found = better_exchange(one_a(0.9), {column_b}, all);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->term, 0U);
  EXPECT_EQ(found->by.effect, &a);
  EXPECT_FALSE(better_exchange(one_a(0.9), {column_a}, all));
  EXPECT_FALSE(better_exchange(one_a(0.9999), {column_b}, all)) << "twins would change places for ever";
}

// An effect with the first two axes, and one with the middle between them, which it contains: beside that one it gains `across` squared.
struct Contained {
  Effect pair = a;
  std::vector<Candidate> alternatives;
  Evidence evidence;
  explicit Contained(double across) {
    pair.parameters.push_back(pair.parameters.front());
    alternatives = {{&pair, NAN, 0, 2}, {&b, NAN, 2, 1}};
    Eigen::MatrixXd columns = length * Eigen::MatrixXd::Identity(3, 3);
    columns.col(2) = length / std::sqrt(2.0) * Eigen::Vector3d(1.0, 1.0, 0.0);
    evidence = evidence_of(columns, columns.col(2) + across / std::sqrt(2.0) * Eigen::Vector3d(1.0, -1.0, 0.0));
  }
  const Effect* best() const {
    const auto found = best_addition(evidence, {}, alternatives, {}, with_threshold(-10.0), never);
    return found && found->term ? found->term->effect : nullptr;
  }
  const Effect* instead_of(std::size_t named) const {
    const auto found = better_exchange(evidence, {alternatives[named]}, alternatives);
    return found ? found->by.effect : nullptr;
  }
};

// Log p of a gain of 100 with one degree is -52.5, of 100 + across^2 with two -(100 + across^2)/2, and log 2 for the choice of it or of one column:
// 3.5 is 2.9 in favour of the pair, odds of less than 1:100 (4.6), and 7 is 21.
TEST(ContainedEffect, IsNamedWhereTheOtherDoesNotBeatIt) {
  const Contained alike(3.5), unlike(7.0);
  EXPECT_LT(test_group(alike.evidence, {0, 1}, {}).log_p, test_group(alike.evidence, {2}, {}).log_p - 1.0);
  EXPECT_EQ(alike.best(), &b);
  EXPECT_EQ(alike.instead_of(0), &b);
  EXPECT_EQ(alike.instead_of(1), nullptr) << "both would change places for ever";
  EXPECT_EQ(unlike.best(), &unlike.pair);
  EXPECT_EQ(unlike.instead_of(0), nullptr);
  EXPECT_EQ(unlike.instead_of(1), &unlike.pair);
}

// Odds of 1:100 are 4.6 in log p, some 9.2 in Δχ²: b is in a's class at k^2 = 0.94 and not at 0.88. c never is.
TEST(Equivalents, AreThoseWithOddsAboveOneInAHundred) {
  const std::vector<const Effect*> twin = {&b};
  EXPECT_EQ(equivalents(one_a(std::sqrt(0.94)), {column_a}, 0, all), twin);
  EXPECT_TRUE(equivalents(one_a(std::sqrt(0.88)), {column_a}, 0, all).empty());
}

// Twelve dwells of an axis, and a ramp over them.
struct Dwells {
  static constexpr int count = 12;
  std::vector<LocatedColumn> map;
  Eigen::VectorXd time_h{count};
  Dwells() {
    for (int k = 0; k < count; ++k) {
      map.push_back({LocatedColumn::Kind::dwell, k, 3, 3600.0 * k, 3600.0 * (k + 1)});
      time_h(k) = k + 0.5;
    }
  }
  // Columns: the ramp, then the map.
  Evidence of(const Eigen::VectorXd& biases) const {
    Eigen::MatrixXd columns(count, 1 + count);
    columns << length * time_h, length * Eigen::MatrixXd::Identity(count, count);
    return evidence_of(columns, length * biases);
  }
};

// A ramp of biases is a ramp: its Δχ² is the whole square, and a walk's is less by what its freedom costs. Biases that lie
// at right angles to a ramp (+ - - + three times over) are none.
TEST(WalkAgainstRamp, EachIsTakenForWhatItIs) {
  const Dwells dwells;
  const auto decide = [&](const Eigen::VectorXd& biases) {
    const Evidence e = dwells.of(biases);
    return best_addition(e, {}, {column_a}, {test_bias_process(e, dwells.map, 1, {3}, {})}, with_threshold(-10.0),
                         [](const BiasProcess&) { return true; });
  };
  const auto ramp = decide(dwells.time_h);
  ASSERT_TRUE(ramp);
  EXPECT_TRUE(ramp->term && !ramp->process);
  const Eigen::Vector4d zigzag(1.0, -1.0, -1.0, 1.0);
  const auto process = decide(zigzag.replicate<3, 1>());
  ASSERT_TRUE(process);
  EXPECT_TRUE(process->process && !process->term);
}

// Biases that are free by c^2 each leave the ramp 1/(1 + c^2 length^2) of its information, and as much of its score.
TEST(WalkAgainstRamp, MarginalisedBiasesLeaveTheRampLittle) {
  const Dwells dwells;
  Evidence e = dwells.of(dwells.time_h);
  const double information = e.information(0, 0), score = e.score(0), c2 = 0.3;
  std::vector<int> columns;
  for (int k = 1; k <= Dwells::count; ++k) {
    columns.push_back(k);
  }
  e.marginalise(columns, c2 * Eigen::MatrixXd::Identity(Dwells::count, Dwells::count));
  const double left = 1.0 / (1.0 + c2 * length * length);
  EXPECT_NEAR(e.information(0, 0), left * information, 1e-9 * information);
  EXPECT_NEAR(e.score(0), left * score, 1e-9 * score);
}

}  // namespace
}  // namespace selfcal::diagnosis
