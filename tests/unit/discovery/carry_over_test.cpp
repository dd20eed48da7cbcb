// When two laws are one function in other words, on information matrices written down by hand.
#include "estimator/discovery/carry_over.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace selfcal::discovery {
namespace {

PossibleLaw law(int axis, double coefficient) { return {{axis, *laws::Expression::parse("wy"), {}}, coefficient, 1.0}; }

// Two laws of `sigmas` each, the share 1 - cosine^2 of which the other does not explain.
CarryOver two_laws(double sigmas, double share, double scale = 1.0) {
  CarryOver elsewhere;
  const double cross = std::sqrt(1.0 - share);
  elsewhere.information.resize(2, 2);
  elsewhere.information << 1.0, cross * scale, cross * scale, scale * scale;
  elsewhere.information *= sigmas * sigmas;
  return elsewhere;
}

TEST(OneFunction, WhateverUnitItIsWrittenIn) {
  const std::vector<PossibleLaw> laws = {law(1, 1.0), law(1, 0.01)};
  EXPECT_TRUE(one_function(two_laws(30.0, 1e-6, 100.0), laws, 0, 1));
  EXPECT_TRUE(one_function(two_laws(30.0, 1e-6, 100.0), laws, 1, 0));
}

TEST(OneFunction, NotWhatAStrongLawTellsApart) {
  const std::vector<PossibleLaw> laws = {law(1, 1.0), law(1, 1.0)};
  EXPECT_TRUE(one_function(two_laws(10.0, 0.005), laws, 0, 1));    // 0.7 sigma
  EXPECT_FALSE(one_function(two_laws(100.0, 0.005), laws, 0, 1));  // 7 sigma
}

// What is too weak to be told apart is not the same for that.
TEST(OneFunction, NotWhatIsOnlyWeak) {
  const std::vector<PossibleLaw> laws = {law(1, 1.0), law(1, 1.0)};
  EXPECT_FALSE(one_function(two_laws(2.0, 0.2), laws, 0, 1));
}

TEST(OneFunction, NotOfTwoAxesAndNotWhereNothingIsSeen) {
  EXPECT_FALSE(one_function(two_laws(30.0, 0.0), {law(1, 1.0), law(2, 1.0)}, 0, 1));
  CarryOver unseen = two_laws(30.0, 0.0);
  unseen.information.setZero();  // of temperature nobody knows what another plan shows
  EXPECT_FALSE(one_function(unseen, {law(1, 1.0), law(1, 1.0)}, 0, 1));
}

// A level base: the gimbal cannot tell them apart, another attitude of the base can.
TEST(OneFunction, OnlyAsLongAsTheBaseStandsAsItDoes) {
  const std::vector<PossibleLaw> laws = {law(1, 1.0), law(1, 1.0)};
  CarryOver elsewhere = two_laws(30.0, 0.3);
  elsewhere.here = two_laws(30.0, 1e-6).information;
  EXPECT_FALSE(one_function(elsewhere, laws, 0, 1));
  EXPECT_TRUE(one_function_here(elsewhere, laws, 0, 1));
}

}  // namespace
}  // namespace selfcal::discovery
