// What a value of a constant stands for.
#include "estimator/discovery/law_class.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

namespace selfcal::discovery {
namespace {

std::vector<Candidate> creeps(const std::vector<double>& constants, double spacing) {
  std::vector<Candidate> all;
  for (const double constant : constants) {
    Candidate c;
    c.term.expression = *laws::Expression::parse("exp(-since/?)");
    c.term.constants = {constant};
    c.spacing = spacing;
    all.push_back(c);
  }
  return all;
}

// Values as far apart as the dictionary's have the whole belief of one of these each, but those at the ends, beyond which none is asked.
TEST(SharesOf, ValuesOfTheDictionaryAreOneEach) {
  const std::vector<double> shares = shares_of(creeps({10.0, 20.0, 40.0, 80.0}, std::log(2.0)));
  EXPECT_NEAR(shares[0], 0.5, 1e-12);
  EXPECT_NEAR(shares[1], 1.0, 1e-12);
  EXPECT_NEAR(shares[2], 1.0, 1e-12);
  EXPECT_NEAR(shares[3], 0.5, 1e-12);
}

// Together they stand for the span from the first to the last, however many lie in it and wherever.
TEST(SharesOf, TogetherAreTheSpan) {
  for (const std::vector<double>& constants :
       {std::vector{10.0, 80.0}, {10.0, 11.0, 13.0, 80.0}, {10.0, 70.0, 75.0, 80.0}}) {
    const std::vector<double> shares = shares_of(creeps(constants, 0.5));
    EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), std::log(8.0) / 0.5, 1e-12);
  }
}

TEST(SharesOf, WhatHasNoConstantIsOne) {
  EXPECT_EQ(shares_of(creeps({30.0}, 0.4)), std::vector<double>{1.0});
  EXPECT_EQ(shares_of(creeps({30.0, 60.0}, 0.0)), (std::vector<double>{1.0, 1.0}));
}

}  // namespace
}  // namespace selfcal::discovery
