#include "estimator/passes/dynamic_transition.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace selfcal {
namespace {

Interval interval(double start_s, double end_s) {
  Interval one;
  one.start_s = start_s;
  one.end_s = end_s;
  one.length_s = end_s - start_s;
  one.Phi.setIdentity();
  one.Gamma.setZero(9, sensor_parameter_count);
  return one;
}

// Variance after each of the intervals, from `sigma` squared on.
std::vector<double> variances(const BiasNoise& bias, const std::vector<Interval>& intervals) {
  double variance = bias.sigma * bias.sigma;
  std::vector<double> all;
  for (const Interval& one : intervals) {
    variance = bias.kept(one) * bias.kept(one) * variance + bias.drive_variance(one);
    all.push_back(variance);
  }
  return all;
}

// A time between two intervals belongs to one of them, whichever way they are gone through; the end of the recording to the last.
TEST(BiasNoise, IsDrawnOnceAtEachTime) {
  const BiasNoise bias{.sigma = 3.0, .drawn_anew_s = {1.0, 2.5, 4.0}};
  int drawn = 0;
  for (int k = 0; k < 4; ++k) {
    const Interval one = interval(k, k + 1.0);
    drawn += bias.drawn_in(one) ? 1 : 0;
    EXPECT_EQ(bias.kept(one), bias.drawn_in(one) ? 0.0 : 1.0) << k;
    EXPECT_EQ(bias.drive_variance(one), bias.drawn_in(one) ? 9.0 : 0.0) << k;
  }
  EXPECT_EQ(drawn, 3);
}

// Its size is the same at all times, whether it jumps, wanders or both; a walk grows with the time.
TEST(BiasNoise, IsStationaryButForAWalk) {
  const std::vector<Interval> intervals = {interval(0, 1), interval(1, 2), interval(2, 3.7), interval(3.7, 10)};
  for (const double correlation_s : {HUGE_VAL, 2.0}) {
    for (const double variance :
         variances({.sigma = 3.0, .correlation_s = correlation_s, .drawn_anew_s = {1.5}}, intervals)) {
      EXPECT_NEAR(variance, 9.0, 1e-12);
    }
  }
  EXPECT_NEAR(variances({.rate = 0.5}, intervals).back(), 0.25 * 10.0, 1e-12);
}

// Two draws of one process have nothing in common across such a time, and all of it else.
TEST(BiasNoise, GoesOnAsItSaysInTheTransition) {
  DynamicTransition transition({}, {{.parameter = 0, .sigma = 1.0, .drawn_anew_s = {5.5}}}, 1.0);
  Interval one = interval(4.0, 5.0);
  one.Gamma(3, 0) = 0.25;
  EXPECT_EQ(transition.over(one)(9, 9), 1.0);
  EXPECT_EQ(transition.over(one)(3, 9), 0.25);
  Interval jump = interval(5.0, 6.0);
  jump.Gamma(3, 0) = 0.25;
  EXPECT_EQ(transition.over(jump)(9, 9), 0.0);
  EXPECT_EQ(transition.over(jump)(3, 9), 0.125);  // the value before acts on one half of it, the new one on the other
  EXPECT_EQ(transition.drive(jump)(3, 0), 0.125);
}

}  // namespace
}  // namespace selfcal
