#include "estimator/geometry/angles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace selfcal {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;

TEST(Unwrapped, AnEncoderThatBeginsAgainGoesOn) {
  std::vector<double> read, true_angle;
  for (int k = 0; k < 400; ++k) {  // five turns forward and back, from -1 rad on
    true_angle.push_back(-1.0 + 0.16 * (k < 200 ? k : 400 - k));
    read.push_back(true_angle.back() - turn * std::floor(true_angle.back() / turn));
  }
  const std::vector<double> all = unwrapped(read);
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_NEAR(all[k] - all.front(), true_angle[k] - true_angle.front(), 1e-12);
  }
}

TEST(Unwrapped, WhatNeverBeginsAgainKeepsItsBits) {
  const std::vector<double> angle = {0.1, 3.0, 6.1, 9.0, 12.1, 9.0};
  EXPECT_EQ(unwrapped(angle), angle);
  EXPECT_TRUE(unwrapped({}).empty());
}

}  // namespace
}  // namespace selfcal
