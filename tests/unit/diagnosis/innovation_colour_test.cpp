// Autoregressions drawn here, and what must come out of them: their coefficients, white rows, the likelihood of the whole.
#include "estimator/diagnosis/regression/innovation_colour.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>
#include <random>

namespace selfcal::diagnosis {
namespace {

constexpr Eigen::Index axes = 3;
constexpr Eigen::Index epochs = 3000;

// x_k = phi x_{k-1} + e_k on the first axis, white of unit variance on the others.
Eigen::VectorXd drawn(double phi, unsigned seed, double offset = 0.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd x(axes * epochs);
  for (Eigen::Index row = 0; row < x.size(); ++row) {
    const bool first = row % axes == 0;
    x(row) = normal(random) + (first && row >= axes ? phi * x(row - axes) : 0.0);
  }
  // A bias of every other dwell, which is no noise.
  for (Eigen::Index row = 0; row < x.size(); ++row) {
    x(row) += (row / axes / 60) % 2 == 0 ? offset : -offset;
  }
  return x;
}

std::vector<std::size_t> dwells_of_a_minute() {
  std::vector<std::size_t> segment(static_cast<std::size_t>(epochs));
  std::iota(segment.begin(), segment.end(), std::size_t{0});
  for (std::size_t& s : segment) {
    s /= 60;
  }
  return segment;
}

// Of the first axis, over all epochs.
double autocorrelation(const Eigen::VectorXd& x) {
  double product = 0.0, square = 0.0;
  for (Eigen::Index row = axes; row < x.size(); row += axes) {
    product += x(row) * x(row - axes);
    square += x(row) * x(row);
  }
  return product / square;
}

// Of 3000 epochs a coefficient is known to sqrt((1 - phi^2) / 3000) = 0.016 for phi = 0.5, the variance to 2.6 %; the lines through 50 dwells
// of 60 epochs take 3 % of both at most. Five sigma and that.
TEST(InnovationColour, OfAnAutoregressionIsWhatItWasDrawnWith) {
  const InnovationColour colour = colour_of(drawn(0.5, 1), dwells_of_a_minute());
  ASSERT_FALSE(colour[0].phi.empty());
  // Where its spectrum lies below that of white noise (above a quarter of the rate) it is lifted: to 1 from 1 / 2.25 at the end.
  EXPECT_GT(colour[0].phi[0], 0.2);
  EXPECT_LT(colour[0].phi[0], 0.6);
  EXPECT_NEAR(colour[0].spread, std::sqrt(1.0 / 0.75), 0.15);
}

TEST(InnovationColour, OfWhiteNoiseChangesLittle) {
  const Eigen::VectorXd x = drawn(0.0, 2);
  const InnovationColour colour = colour_of(x, dwells_of_a_minute());
  Eigen::VectorXd white = x;
  whiten(colour, white);
  // Of 9000 values the square is known to 1.5 %; a density that is lifted where chance left it below one adds to what is divided by.
  EXPECT_NEAR(white.squaredNorm() / x.squaredNorm(), 1.0, 0.08);
}

// A bias by dwell is what the diagnosis looks for: the colour must not take it for noise.
TEST(InnovationColour, OfDwellsWithBiasesIsThatOfTheNoiseAlone) {
  const InnovationColour without = colour_of(drawn(0.5, 3), dwells_of_a_minute());
  const InnovationColour with = colour_of(drawn(0.5, 3, 20.0), dwells_of_a_minute());
  ASSERT_EQ(with[0].phi.size(), without[0].phi.size());
  for (std::size_t i = 0; i < with[0].phi.size(); ++i) {
    EXPECT_NEAR(with[0].phi[i], without[0].phi[i], 1e-6);
  }
  EXPECT_NEAR(with[0].sigma, without[0].sigma, 1e-6);
}

TEST(InnovationColour, RowsFromWhichItWasTakenAreNoLongerCorrelated) {
  const Eigen::VectorXd x = drawn(0.8, 4);
  ASSERT_GT(autocorrelation(x), 0.7);
  const InnovationColour colour = colour_of(x, dwells_of_a_minute());
  Eigen::MatrixXd rows = x;
  whiten(colour, rows);
  // The spectrum of x, S = 1 / |1 - 0.8 e^-iw|^2, lies below that of white noise at high frequencies and is lifted there: what is left
  // has min(1, S).
  double product = 0.0, square = 0.0;
  for (double w = 0.0005 * M_PI; w < M_PI; w += 0.001 * M_PI) {
    const double left = std::min(1.0, 1.0 / (1.64 - 1.6 * std::cos(w)));
    product += left * std::cos(w);
    square += left;
  }
  EXPECT_NEAR(autocorrelation(rows), product / square, 5.0 / std::sqrt(static_cast<double>(epochs)));
  EXPECT_LT((with_colour(colour, rows) - x).cwiseAbs().maxCoeff(), 1e-9);
}

// The filter as a matrix W: cov = (W^T W)^-1, so log-likelihood of x = -|W x|^2 / 2 + log det W but for a constant.
TEST(InnovationColour, TheChangeOfVariablesIsTheDeterminant) {
  const InnovationColour colour{{{{0.5, -0.2}, 0.9, 1.3}, {{}, 1.2, 1.2}, {{0.3}, 1.1, 1.4}}};
  constexpr Eigen::Index rows = 24;
  Eigen::MatrixXd W = Eigen::MatrixXd::Identity(rows, rows);
  whiten(colour, W);
  EXPECT_NEAR(log_determinant(colour, rows), std::log(W.determinant()), 1e-12);
}

TEST(InnovationColour, OfTooFewEpochsIsNone) {
  const std::vector<std::size_t> segment(100, 0);
  EXPECT_TRUE(is_white(colour_of(drawn(0.5, 5).head(300), segment)));
  EXPECT_FALSE(is_white(colour_of(drawn(0.5, 5), dwells_of_a_minute())));
}

}  // namespace
}  // namespace selfcal::diagnosis
