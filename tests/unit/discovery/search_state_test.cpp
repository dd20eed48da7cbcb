#include "estimator/discovery/search_state.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace selfcal::discovery {
namespace {

LawTerm creep(double tau) { return {2, *laws::Expression::parse("exp(-t/?)"), {tau}}; }

SearchState of_law(double tau) {
  SearchState state;
  state.terms = {creep(tau)};
  return state;
}

SearchState of_walk() {
  SearchState state;
  DiscoveredProcess walk;
  walk.kind = ProcessKind::random_walk;
  walk.axis = 2;
  state.processes = {walk};
  return state;
}

TEST(OtherExplanation, AWalkStandsInALawsPlace) {
  const auto instead = other_explanation(of_law(0.5), of_walk(), std::log(20.0), 0.01);
  ASSERT_TRUE(instead);
  EXPECT_NEAR(instead->odds, 0.05, 1e-12);
  EXPECT_TRUE(instead->laws.empty());
  ASSERT_EQ(instead->processes.size(), 1U);
  EXPECT_EQ(instead->processes.front().axis, 2);
}

TEST(OtherExplanation, ALawStandsInAWalksPlace) {
  const auto instead = other_explanation(of_walk(), of_law(0.5), 0.0, 0.01);
  ASSERT_TRUE(instead);
  EXPECT_EQ(instead->odds, 1.0);
  ASSERT_EQ(instead->laws.size(), 1U);
  EXPECT_EQ(instead->laws.front().expression, "exp(-t/0.5)");
}

TEST(OtherExplanation, WhatIsLessProbableIsNone) {
  EXPECT_FALSE(other_explanation(of_law(0.5), of_walk(), std::log(101.0), 0.01));
}

TEST(OtherExplanation, OtherNumbersAreNoOtherExplanation) {
  EXPECT_FALSE(other_explanation(of_law(0.5), of_law(0.6), 0.1, 0.01));
}

}  // namespace
}  // namespace selfcal::discovery
