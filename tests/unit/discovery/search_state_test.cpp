#include "estimator/discovery/search_state.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"

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

// A law of 2 units whose unit moves a misalignment of the gyros. A degree is what a sensor may have.
bool stands_where_it_moves(double per_unit_rad) {
  LawFit fit;
  fit.terms = {creep(0.5)};
  fit.coefficient = Eigen::VectorXd::Constant(1, -2.0);
  fit.gain = {100.0};
  fit.held_out_gain = {49.0};
  fit.recordings.resize(2);
  for (FittedRecording& r : fit.recordings) {
    r.shift = Eigen::MatrixXd::Zero(sensor_parameter_count, 2);
  }
  fit.recordings.back().shift(parameter::gyro_misalignment, 0) = per_unit_rad;
  fit.recordings.back().shift(parameter::gyro_misalignment, 1) = 1.0;  // of its constant
  return stands(fit, 0);
}

TEST(Stands, WhatLeavesTheTwentyFourWhereASensorMayHaveThem) {
  EXPECT_TRUE(stands_where_it_moves(0.0));
  EXPECT_TRUE(stands_where_it_moves(0.24 * units::degree));
  EXPECT_FALSE(stands_where_it_moves(0.26 * units::degree));
  EXPECT_FALSE(stands_where_it_moves(-0.26 * units::degree));
}

}  // namespace
}  // namespace selfcal::discovery
