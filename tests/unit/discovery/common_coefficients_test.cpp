// Which coefficients of an effect recordings share, on numbers whose answer is known in closed form.
#include "estimator/discovery/common_coefficients.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace selfcal::discovery {
namespace {

// Two coefficients on two recordings, one after the other: places 0 1 and 2 3.
std::vector<CoefficientPlaces> two_coefficients() {
  std::vector<CoefficientPlaces> all(2);
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t k = 0; k < 2; ++k) {
      all[k].add(r, static_cast<Eigen::Index>(2 * r + k));
    }
  }
  return all;
}

JointGaussian of_sigma_one(const Eigen::VectorXd& x) { return {x, Eigen::MatrixXd::Identity(x.size(), x.size())}; }

TEST(CommonCoefficients, AllOfThemAreTheWeightedMean) {
  JointGaussian all = of_sigma_one(Eigen::Vector4d(1.0, 5.0, 2.0, 5.0));
  all.covariance(2, 2) = 3.0;  // weights 1 and 1/3
  const CommonCoefficients decision = decide_common(two_coefficients(), all);
  EXPECT_TRUE(decision.common[0] && decision.common[1]);
  EXPECT_TRUE(decision.differing.empty());
  // d = (1, 0) with variances 4 and 2: the tail of chi-squared(2) at 1/4 is exp(-1/8).
  EXPECT_NEAR(decision.log_p, -0.125, 1e-12);
  for (const int place : {0, 2}) {
    EXPECT_NEAR(all.x(place), (1.0 + 2.0 / 3.0) / (4.0 / 3.0), 1e-12);
    EXPECT_NEAR(all.covariance(place, place), 0.75, 1e-12);
  }
  EXPECT_NEAR(all.covariance(1, 1), 0.5, 1e-12);
}

// One coefficient changed: it is free and told, and the other one stays common.
TEST(CommonCoefficients, WhatChangedIsFreeAndTheRestIsCommon) {
  JointGaussian all = of_sigma_one(Eigen::Vector4d(0.0, 1.0, 20.0, 2.0));
  const CommonCoefficients decision = decide_common(two_coefficients(), all);
  EXPECT_FALSE(decision.common[0]);
  EXPECT_TRUE(decision.common[1]);
  ASSERT_EQ(decision.differing.size(), 1U);
  EXPECT_EQ(decision.differing[0].coefficient, 0);
  EXPECT_EQ(decision.differing[0].recording, 1U);
  EXPECT_NEAR(decision.differing[0].difference, 20.0, 1e-12);
  EXPECT_NEAR(decision.differing[0].sigma, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(all.x(0), 0.0, 1e-12);
  EXPECT_NEAR(all.x(2), 20.0, 1e-12);
  EXPECT_NEAR(all.x(1), 1.5, 1e-12);
  EXPECT_NEAR(all.x(3), 1.5, 1e-12);
}

// The limit is that of the p-value: with one coefficient d^2/2 is chi-squared(1), whose tail is 1 % at 2.5758^2.
TEST(CommonCoefficients, TheLimitIsOnePercent) {
  std::vector<CoefficientPlaces> one(1);
  one[0].add(0, 0);
  one[0].add(1, 1);
  for (const double z : {2.57, 2.58}) {
    JointGaussian all = of_sigma_one(Eigen::Vector2d(0.0, z * std::sqrt(2.0)));
    EXPECT_EQ(decide_common(one, all).common[0], z < 2.5758) << z;
  }
}

TEST(CommonCoefficients, WhatOneRecordingAloneHasStaysAsItIs) {
  std::vector<CoefficientPlaces> one(1);
  one[0].add(1, 0);
  JointGaussian all = of_sigma_one(Eigen::VectorXd::Constant(1, 7.0));
  const CommonCoefficients decision = decide_common(one, all);
  EXPECT_TRUE(decision.common[0]);
  EXPECT_EQ(decision.log_p, 0.0);
  EXPECT_EQ(all.x(0), 7.0);
}

}  // namespace
}  // namespace selfcal::discovery
