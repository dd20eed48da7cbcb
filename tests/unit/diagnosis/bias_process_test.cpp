// Covariance of a bias process over dwells, by integrals done numerically, and what the columns of dwells tell of a known process.
#include "estimator/diagnosis/regression/bias_process.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/diagnosis/linear.hpp"

namespace selfcal::diagnosis {
namespace {

// Mean over both intervals of a kernel of two times.
template <typename Kernel>
double mean_over(Kernel kernel, double a0, double a1, double b0, double b1) {
  constexpr int n = 400;
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      sum += kernel(a0 + (i + 0.5) / n * (a1 - a0), b0 + (j + 0.5) / n * (b1 - b0));
    }
  }
  return sum / (n * n);
}

TEST(BiasKernel, IsTheMeanOverBothIntervals) {
  const BiasKernel walk, wander{BiasKernel::Kind::instability, 120.0};
  const auto of_walk = [](double s, double t) { return std::min(s, t) / 3600.0; };
  const auto of_wander = [](double s, double t) { return std::exp(-std::abs(s - t) / 120.0); };
  const std::array<std::array<double, 4>, 4> intervals = {
      {{0, 150, 0, 150}, {300, 450, 300, 450}, {0, 150, 160, 400}, {500, 560, 10, 160}}};
  for (const auto& [a0, a1, b0, b1] : intervals) {
    EXPECT_NEAR(walk.covariance(a0, a1, b0, b1), mean_over(of_walk, a0, a1, b0, b1), 1e-4);
    EXPECT_NEAR(wander.covariance(a0, a1, b0, b1), mean_over(of_wander, a0, a1, b0, b1), 1e-4);
    EXPECT_EQ(wander.covariance(a0, a1, b0, b1), wander.covariance(b0, b1, a0, a1));
  }
}

// Twenty dwells, biases of +1 and -1 in blocks of two: what comes back within minutes is no walk, and three axes tell of it what each does.
TEST(BiasProcess, ATriadsProcessCountsEachAxis) {
  constexpr Eigen::Index dwells = 20;
  std::vector<LocatedColumn> map;
  Eigen::VectorXd biases(3 * dwells);
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < dwells; ++k) {
      map.push_back({LocatedColumn::Kind::dwell, k, axis, 150.0 * k, 150.0 * (k + 1)});
      biases(axis * dwells + k) = ((k + axis) / 2) % 2 == 0 ? 1.0 : -1.0;
    }
  }
  constexpr double length = 10.0;
  const Evidence e = evidence_of(length * Eigen::MatrixXd::Identity(3 * dwells, 3 * dwells), length * biases);
  const BiasProcess one = test_bias_process(e, map, 0, {1}, {});
  const BiasProcess triad = test_bias_process(e, map, 0, {0, 1, 2}, {});
  EXPECT_EQ(one.kernel.kind, BiasKernel::Kind::instability);
  EXPECT_EQ(triad.kernel.kind, BiasKernel::Kind::instability);
  EXPECT_LT(triad.kernel.correlation_s, 600.0);
  EXPECT_GT(triad.size, 0.7);
  EXPECT_LT(triad.size, 2.0);
  EXPECT_GT(triad.delta_chi2, 2.5 * one.delta_chi2);
}

}  // namespace
}  // namespace selfcal::diagnosis
