// Averages over explanations in closed form, and what else two columns settle on paper: isolability, held-out gain, the budget.
#include "estimator/diagnosis/search/averaging.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "estimator/diagnosis/holdout.hpp"
#include "estimator/diagnosis/isolability.hpp"
#include "estimator/diagnosis/search/judgement.hpp"
#include "tests/unit/diagnosis/linear.hpp"

namespace selfcal::diagnosis {
namespace {

const Effect a = one_coefficient("a"), b = one_coefficient("b");
const Candidate column_a{&a, NAN, 0, 1}, column_b{&b, NAN, 1, 1};
constexpr std::array<double, 10> scales = {0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0};

// One coefficient of size N(0, s^2) with information G and score y: log of the evidence, mean and variance.
struct Posterior {
  double weight, mean, variance;
};
Posterior posterior(double G, double y, double s) {
  const double precision = 1.0 + G * s * s;
  return {std::exp(0.5 * y * y * s * s / precision) / std::sqrt(precision), s * s * y / precision, s * s / precision};
}

// Two models of one column each, all scales equally likely: probabilities, sizes and the shift of the 24 are sums over twenty
// normals. a moves the first of the 24 by 2 per unit, b by -3.
TEST(Average, OfTwoModelsIsTheClosedForm) {
  const double G_a = 100.0, G_b = 80.0, y_a = 60.0, y_b = 50.0;
  Evidence e;
  e.information = Eigen::Vector2d(G_a, G_b).asDiagonal();
  e.score = Eigen::Vector2d(y_a, y_b);
  e.rows = 3000.0;
  Eigen::MatrixXd shift = Eigen::MatrixXd::Zero(sensor_parameter_count, 2);
  shift.row(0) << 2.0, -3.0;
  PlacedTerm term;
  term.candidate = column_a;
  const Averages found = average_explanations(e, shift, {term}, {column_b});

  double all = 0.0, own = 0.0, size = 0.0, moved = 0.0, square = 0.0;
  for (const double s : scales) {
    const Posterior p = posterior(G_a, y_a, s), q = posterior(G_b, y_b, s);
    own += p.weight;
    size += p.weight * p.mean;
    all += p.weight + q.weight;
    moved += p.weight * 2.0 * p.mean + q.weight * -3.0 * q.mean;
    square += p.weight * 4.0 * (p.variance + p.mean * p.mean) + q.weight * 9.0 * (q.variance + q.mean * q.mean);
  }
  ASSERT_EQ(found.terms.size(), 1U);
  EXPECT_NEAR(found.terms[0].probability.at(&a), own / all, 1e-9);
  EXPECT_NEAR(found.terms[0].probability.at(&b), 1.0 - own / all, 1e-9);
  EXPECT_NEAR(found.terms[0].amplitude(0), size / own, 1e-9);
  EXPECT_NEAR(found.shift(0), moved / all, 1e-9);
  EXPECT_NEAR(found.shift_covariance(0, 0), square / all - (moved / all) * (moved / all), 1e-9);
  EXPECT_EQ(found.shift(1), 0.0);
}

// Where the rival explains nothing (odds beyond e^25) the average is the model's own.
TEST(Average, LeavesOutWhatExplainsNothing) {
  Evidence e;
  e.information = 100.0 * Eigen::Matrix2d::Identity();
  e.score = Eigen::Vector2d(200.0, 0.0);
  e.rows = 3000.0;
  PlacedTerm term;
  term.candidate = column_a;
  const Averages found = average_explanations(e, Eigen::MatrixXd::Zero(sensor_parameter_count, 2), {term}, {column_b});
  EXPECT_EQ(found.terms[0].probability.size(), 1U);
  EXPECT_NEAR(found.terms[0].probability.at(&a), 1.0, 1e-12);
  EXPECT_TRUE(average_explanations(e, Eigen::MatrixXd(), {}, {column_b}).terms.empty());
}

// A rival at cosine k leaves 1 - k^2 of the effect's square; of two variants the closer counts.
TEST(Separation, IsWhatTheProjectionLeaves) {
  Eigen::MatrixXd Z(3, 3);
  Z << at_angle(10.0, 1.0, 3), at_angle(5.0, 0.6, 3), at_angle(7.0, 0.8, 3);
  Candidate near = column_b, far = column_b;
  far.first = 1;
  near.first = 2;
  const Eigen::VectorXd size = Eigen::VectorXd::Constant(1, 3.0);
  const std::vector<Separation> found = separations(Z.transpose() * Z, {column_a, far, near}, size);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].closest, &b);
  EXPECT_NEAR(found[0].square, 900.0 * (1.0 - 0.64), 1e-3);  // the prior of 1000 typical sizes: 1e-6 of 900
  EXPECT_NEAR(found[0].share, 1.0 - 0.64, 1e-6);
}

// Of a rival that holds the effect as a special case nothing splits it: share 0. What is at right angles leaves all.
TEST(Separation, OfARivalThatContainsTheEffectIsNone) {
  Effect two = b;
  two.parameters.push_back(b.parameters.front());
  const Effect other = one_coefficient("c");
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(4, 4);
  Z.col(0) << 10.0, 0.0, 0.0, 0.0;
  Z.col(1) << 3.0, 4.0, 0.0, 0.0;  // with the next one it spans the effect's direction
  Z.col(2) << -2.0, 5.0, 0.0, 0.0;
  Z.col(3) << 0.0, 0.0, 0.0, 8.0;
  const std::vector<Separation> found =
      separations(Z.transpose() * Z, {column_a, {&two, NAN, 1, 2}, {&other, NAN, 3, 1}}, Eigen::VectorXd::Ones(1));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_LT(found[0].share, 1e-6);
  EXPECT_NEAR(found[1].share, 1.0, 1e-12);
  EXPECT_NEAR(found[1].square, 100.0, 1e-9);
}

// Two of the 24 are determined and differ by 3 of sqrt(1 + 4) and by 1 of sqrt(1 + 1): (9/5 + 1/2)/2. The third does not count.
TEST(Disagreement, IsTheMeanSquareOfWhatBothDetermine) {
  const ParameterVector zero = ParameterVector::Zero();
  ParameterVector second = zero, first_sigma = ParameterVector::Ones(), second_sigma = ParameterVector::Ones();
  second.head<3>() << 3.0, -1.0, 100.0;
  second_sigma(0) = 2.0;
  std::array<bool, sensor_parameter_count> determined{};
  EXPECT_EQ(disagreement(zero, first_sigma, second, second_sigma, determined), 0.0);
  determined[0] = determined[1] = true;
  EXPECT_NEAR(disagreement(zero, first_sigma, second, second_sigma, determined), (9.0 / 5.0 + 0.5) / 2.0, 1e-12);
}

// n rows in two halves and a column of ones. A bias m in both is predicted from the other half: n m^2 / 2. The opposite sign in
// either half is predicted wrongly: -3 n m^2 / 2. What only one half shows is not predicted at all.
TEST(HeldOutGain, IsWhatTheOtherPartsPredict) {
  constexpr int n = 40;
  constexpr double m = 0.7;
  Eigen::MatrixXd columns(n, 2);
  columns.col(0).setOnes();
  columns.col(1) << Eigen::VectorXd::Ones(n / 2), Eigen::VectorXd::Zero(n / 2);
  std::vector<int> half(n, 0);
  std::fill(half.begin() + n / 2, half.end(), 1);
  Eigen::VectorXd opposite = Eigen::VectorXd::Constant(n, m);
  opposite.tail(n / 2) *= -1.0;
  const Eigen::VectorXd same = Eigen::VectorXd::Constant(n, m);
  EXPECT_NEAR(held_out_gain(columns, same, half, {0}, {}), 0.5 * n * m * m, 1e-9);
  EXPECT_NEAR(held_out_gain(columns, opposite, half, {0}, {}), -1.5 * n * m * m, 1e-9);
  EXPECT_NEAR(held_out_gain(columns, same, half, {1}, {}), 0.0, 1e-9);
}

TEST(FalseAlarmBudget, AddsUp) {
  EXPECT_TRUE(budget_of_one.adds_up());
  EXPECT_TRUE(budget_of_two.adds_up());
  FalseAlarmBudget more = budget_of_one;
  more.names += 0.05;
  EXPECT_FALSE(more.adds_up());  // the negative control
}

}  // namespace
}  // namespace selfcal::diagnosis
