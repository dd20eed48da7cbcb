// Distributions and the test for whiteness, against closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "estimator/statistics/climb.hpp"
#include "estimator/statistics/distributions.hpp"
#include "estimator/statistics/newton_climb.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal {
namespace {

// Two degrees of freedom: the tail is exp(-x/2) exactly. The routine promises 1e-10.
TEST(ChiSquaredTail, IsExponentialForTwoDegrees) {
  for (const double x : {0.1, 1.0, 3.9, 4.1, 50.0, 5000.0}) {
    EXPECT_NEAR(log_chi_squared_tail(x, 2.0), -0.5 * x, 1e-10 * x + 1e-12);
  }
}

// One degree: erfc, good to rounding where it does not underflow.
TEST(ChiSquaredTail, IsNormalForOneDegree) {
  for (const double z : {0.5, 2.0, 5.0, 10.0}) {
    EXPECT_NEAR(log_chi_squared_tail(z * z, 1.0), std::log(std::erfc(z / std::sqrt(2.0))), 1e-9);
    EXPECT_NEAR(sigma_from_log_p(log_chi_squared_tail(z * z, 1.0)), z, 1e-6);
  }
}

// Even degrees: exp(-x/2) times the first terms of the series of exp(x/2) (Abramowitz and Stegun 26.4.5). 60 are those of
// the test for whiteness.
TEST(ChiSquaredTail, IsASumForEvenDegrees) {
  for (const double x : {20.0, 61.9, 62.1, 99.6, 200.0}) {
    double term = 1.0, sum = 1.0;
    for (int k = 1; k < 30; ++k) {
      term *= 0.5 * x / k;
      sum += term;
    }
    EXPECT_NEAR(log_chi_squared_tail(x, 60.0), -0.5 * x + std::log(sum), 1e-10);
  }
}

// Two degrees in the numerator: P(F > f) = (1 + 2 f/n)^(-n/2).
TEST(FTail, IsAPowerForTwoDegrees) {
  for (const double n : {5.0, 30.0, 200.0}) {
    for (const double f : {0.01, 1.0, 7.0, 400.0}) {
      EXPECT_NEAR(log_f_tail(f, 2.0, n), -0.5 * n * std::log1p(2.0 * f / n), 1e-9 * (1.0 + n * f));
    }
  }
}

// One and one: F is the square of a Cauchy variable, P = 1 - 2/pi atan(sqrt(f)).
TEST(FTail, IsCauchyForOneAndOne) {
  for (const double f : {0.1, 1.0, 50.0}) {
    EXPECT_NEAR(std::exp(log_f_tail(f, 1.0, 1.0)), 1.0 - 2.0 / M_PI * std::atan(std::sqrt(f)), 1e-12);
  }
}

// +1, -1, +1 ... on each axis: the product at a lag is (n - lag)/n of the square, with its sign, so that Ljung and Box's sum is
// 3 (n+2)/n sum over lags of (n - lag).
TEST(Whiteness, OfAlternatingSignsIsKnown) {
  for (const int n : {100, 6}) {
    Eigen::VectorXd x(3 * n);
    for (int k = 0; k < n; ++k) {
      x.segment<3>(3 * k).setConstant(k % 2 == 0 ? 1.0 : -1.0);
    }
    const int lags = std::min(20, n - 1);
    const double statistic = 3.0 * (n + 2.0) / n * (n * lags - 0.5 * lags * (lags + 1));
    const Whiteness white = test_whiteness(x);
    EXPECT_NEAR(white.log_p, log_chi_squared_tail(statistic, 3.0 * lags), 1e-9 * statistic);
    EXPECT_NEAR(white.autocorrelation, -(n - 1.0) / n, 1e-12);
  }
}

// p of white noise is uniform: of 400 draws 5 % +- 1.1 % lie below 0.05; 4 sigma.
TEST(Whiteness, OfWhiteNoiseIsUniform) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int below = 0;
  constexpr int draws = 400;
  for (int draw = 0; draw < draws; ++draw) {
    Eigen::VectorXd x(3 * 500);
    for (double& value : x) {
      value = normal(random);
    }
    below += test_whiteness(x).log_p < std::log(0.05) ? 1 : 0;
  }
  EXPECT_NEAR(below, 0.05 * draws, 4.0 * std::sqrt(0.05 * 0.95 * draws)) << "seed 7";
}

// Log likelihood with its top at (5, 0.02), logarithms known to 1/10: found to half of the last factor. Where the farthest is a
// factor of 3 from the start the climb ends there.
TEST(Climb, GoesToTheTop) {
  using Point = std::array<double, 2>;
  const std::function<double(const Point&)> log_likelihood = [](const Point& p) {
    const double x = std::log(p[0] / 5.0) / 0.1, y = std::log(p[1] / 0.02) / 0.1;
    return -0.5 * (x * x + y * y);
  };
  const double half = 0.501 * std::log(1.05);
  for (const int moves : {1, 1000}) {
    const Climb how{.factors = {2.0, 1.3, 1.05}, .most_moves = moves};
    const Summit<2> top = climb<2>({1.0, 1.0}, how, log_likelihood);
    EXPECT_LT(std::abs(std::log(top.at[0] / 5.0)), half) << moves;
    EXPECT_LT(std::abs(std::log(top.at[1] / 0.02)), half) << moves;
    EXPECT_EQ(top.log_likelihood, log_likelihood(top.at));
    Climb near = how;
    near.farthest = 3.0;
    const Summit<2> edge = climb<2>({1.0, 1.0}, near, log_likelihood);
    EXPECT_LE(edge.at[0], 3.0);
    EXPECT_GT(edge.at[0], 3.0 / 1.05);
    EXPECT_GE(edge.at[1], 1.0 / 3.0);
  }
}

// In one round a single move takes a quantity one factor further; many take it to the top: 1.3^6 is 4.83 of 5.
TEST(Climb, MovesAsOftenAsItMay) {
  const std::function<double(const std::array<double, 1>&)> log_likelihood = [](const std::array<double, 1>& p) {
    return -std::abs(std::log(p[0] / 5.0));
  };
  Climb how{.factors = {1.3}, .most_rounds = 1};
  EXPECT_NEAR(climb<1>({1.0}, how, log_likelihood).at[0], 1.3, 1e-12);
  how.most_moves = 1000;
  EXPECT_NEAR(climb<1>({1.0}, how, log_likelihood).at[0], std::pow(1.3, 6.0), 1e-12);
  how.most_moves = 1;
  how.most_rounds = 30;
  how.enough = 1.0;  // no single move gains as much: the first round is the last
  EXPECT_NEAR(climb<1>({1.0}, how, log_likelihood).at[0], 1.3, 1e-12);
}

// Log likelihood of the variance of n draws whose mean square is q: -n/2 (log v + q/v), its top at q, information of log v n/2.
TEST(NewtonClimb, FindsAVariance) {
  constexpr double n = 40.0, q = 7.0;
  int asked = 0;
  const std::function<double(const std::array<double, 1>&)> log_likelihood = [&](const std::array<double, 1>& v) {
    ++asked;
    return -0.5 * n * (std::log(v[0]) + q / v[0]);
  };
  for (const double start : {1.0, 3.5, 7.0, 14.0, 60.0}) {
    asked = 0;
    const NewtonTop<1> top = newton_climb<1>({start}, {}, log_likelihood);
    EXPECT_NEAR(std::log(top.at[0] / q), 0.0, 0.1 / std::sqrt(0.5 * n)) << start;  // a tenth of sigma
    EXPECT_EQ(top.log_likelihood, log_likelihood(top.at));
    EXPECT_NEAR(top.information(0, 0), 0.5 * n, 0.2 * n) << start;
    EXPECT_LE(asked, 20) << start;
  }
  const NewtonTop<1> edge = newton_climb<1>({1.0}, {.farthest = 3.0}, log_likelihood);
  EXPECT_NEAR(edge.at[0], 3.0, 1e-12);
}

// Two quantities whose logarithms the data hold together to 0.1 and apart to 1: the top at (5, 0.02).
TEST(NewtonClimb, FollowsARidge) {
  using Point = std::array<double, 2>;
  const std::function<double(const Point&)> log_likelihood = [](const Point& p) {
    const double x = std::log(p[0] / 5.0), y = std::log(p[1] / 0.02);
    return -0.5 * ((x + y) * (x + y) / 0.01 + (x - y) * (x - y));
  };
  const NewtonTop<2> top = newton_climb<2>({1.0, 0.08}, {}, log_likelihood);
  const double x = std::log(top.at[0] / 5.0), y = std::log(top.at[1] / 0.02);
  EXPECT_LT(std::abs(x + y), 0.01);
  EXPECT_LT(std::abs(x - y), 0.2);
  const Eigen::Matrix2d expected = (Eigen::Matrix2d() << 101.0, 99.0, 99.0, 101.0).finished();
  EXPECT_LT((top.information - expected).norm(), 1e-3 * expected.norm());
}

// A likelihood that grows for ever ends where it may, one that falls to a quantity of nothing too.
TEST(NewtonClimb, EndsWhereThereIsNoTop) {
  for (const double way : {1.0, -1.0}) {
    const NewtonTop<1> top = newton_climb<1>({2.0}, {.farthest = 20.0, .most_rounds = 12},
                                             [&](const std::array<double, 1>& x) { return way * std::log(x[0]); });
    EXPECT_NEAR(way * std::log(top.at[0] / 2.0), std::log(20.0), 1e-9);
  }
}

}  // namespace
}  // namespace selfcal
