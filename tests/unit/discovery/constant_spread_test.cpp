// Sigma of a coefficient that follows the law's constant along a curve, where the curve can be integrated on paper.
#include "estimator/discovery/constant_spread.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace selfcal::discovery {
namespace {

constexpr double tau = 40.0;  // s, the most probable value

struct Grid {
  std::vector<double> values;
  std::vector<SingleFit> fits;
};

// log(tau) is Gaussian with `log_sigma`; the coefficient is `follows`(log tau - its mean) with variance 1 beside it.
template <typename F>
Grid grid(double log_sigma, F&& follows) {
  Grid g;
  for (int k = -10; k <= 10; ++k) {
    const double x = 0.5 * k;
    g.values.push_back(tau * std::exp(x * log_sigma));
    g.fits.push_back({100.0 - x * x, follows(x * log_sigma), 1.0});
  }
  return g;
}

// Sums over a Gaussian at half its sigma are its integrals to 1e-8.
constexpr double tolerance = 1e-4;

TEST(ConstantSpread, AStraightLineAddsSquares) {
  const Grid g = grid(0.3, [](double x) { return 50.0 + 10.0 * x; });
  EXPECT_NEAR(spread_about(50.0, tau, g.fits, g.values).coefficient, std::sqrt(1.0 + 9.0), tolerance);
}

// E (e^x - 1)^2 = e^(2 s^2) - 2 e^(s^2/2) + 1: at s = 0.5 a sixth more than the tangent's s.
TEST(ConstantSpread, ACurveIsLongerThanItsTangent) {
  constexpr double s = 0.5;
  const Grid g = grid(s, [](double x) { return 50.0 * std::exp(x); });
  const double square = std::exp(2.0 * s * s) - 2.0 * std::exp(0.5 * s * s) + 1.0;
  const ConstantSpread spread = spread_about(50.0, tau, g.fits, g.values);
  EXPECT_NEAR(spread.coefficient, std::sqrt(1.0 + 2500.0 * square), 50.0 * tolerance);
  EXPECT_NEAR(spread.constant, tau * std::sqrt(square), tau * tolerance);
  EXPECT_GT(spread.coefficient, 1.1 * std::hypot(1.0, 50.0 * s));
}

// What is told is not what is most probable: the distance is of the error.
TEST(ConstantSpread, IsAboutTheValueThatIsTold) {
  const Grid g = grid(0.3, [](double) { return 50.0; });
  EXPECT_NEAR(spread_about(53.0, tau, g.fits, g.values).coefficient, std::sqrt(10.0), tolerance);
}

}  // namespace
}  // namespace selfcal::discovery
