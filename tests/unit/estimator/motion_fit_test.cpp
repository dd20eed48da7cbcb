// The motion model of a moored base: a line of the swell that is weak in one axis must not be left in its innovations.
#include "estimator/passes/motion_fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

namespace selfcal {
namespace {

constexpr int epochs = 2900;
constexpr int order = 10;
constexpr double swell = 2.0 * std::numbers::pi / 11.7, surge = 2.0 * std::numbers::pi / 14.8;   // rad/epoch
constexpr double strong = 0.08, weak = 0.001;   // m: surge seen in east and in north, the host heading nearly east
constexpr double noise = 3e-4;                  // m, white: what the filter that watches adds

using Series = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// Columns: north (swell, and a trace of surge), up (swell), east (surge, and some swell).
Series moored() {
  std::mt19937_64 engine(7);
  std::normal_distribution<double> white(0.0, noise);
  Series series(epochs, 3);
  for (int k = 0; k < epochs; ++k) {
    series(k, 0) = 0.05 * std::sin(swell * k) + weak * std::sin(surge * k + 1.0) + white(engine);
    series(k, 1) = 0.04 * std::sin(swell * k + 0.7) + white(engine);
    series(k, 2) = strong * std::sin(surge * k + 1.0) + 0.03 * std::sin(swell * k + 2.0) + white(engine);
  }
  return series;
}

// |1 - sum a_j exp(-i w j)|: what the prediction leaves of a line.
double left_of_line(const MotionModel& model, double w) {
  std::complex<double> sum = 1.0;
  for (Eigen::Index j = 0; j < model.coefficients.size(); ++j) {
    sum -= model.coefficients(j) * std::polar(1.0, -w * static_cast<double>(j + 1));
  }
  return std::abs(sum);
}

// Mean square of the prediction error contains what is left of a line, amplitude^2/2; so of the strong one at most
// sqrt(2) drives are left, and of the weak one in north weak/strong of that: 0.018 drives (the drives of the axes are
// alike, their noise being so). 0.05 leaves room for the slightly larger drive of east.
TEST(MotionFit, TakesAWeakLineOutWhereAnotherAxisHasItStrong) {
  const auto motion = fit_motion(moored(), order);
  EXPECT_LT(weak * left_of_line(motion[0], surge) / motion[0].innovation_sigma, 0.05);
  EXPECT_LT(strong * left_of_line(motion[2], surge) / motion[2].innovation_sigma, std::sqrt(2.0));
}

// The same without the axis that has it strong: north alone does not pay for it.
TEST(MotionFit, NorthAloneWouldLeaveIt) {
  Series series = moored();
  series.col(1) = series.col(0);
  series.col(2) = series.col(0);
  const auto motion = fit_motion(series, order);
  EXPECT_GT(weak * left_of_line(motion[0], surge) / motion[0].innovation_sigma, 0.05);
}

TEST(MotionFit, PolesStayInsideTheUnitCircleAndAStillAxisIsNoTrouble) {
  Series series = moored();
  series.col(1).setZero();
  for (const MotionModel& model : fit_motion(series, order)) {
    ASSERT_TRUE(model.coefficients.allFinite());
    Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(order, order);
    companion.row(0) = model.coefficients.transpose();
    companion.bottomLeftCorner(order - 1, order - 1).setIdentity();
    EXPECT_LT(companion.eigenvalues().cwiseAbs().maxCoeff(), 1.0);
  }
}

}  // namespace
}  // namespace selfcal
