// What two recordings share, on numbers whose answer is known in closed form.
#include "estimator/discovery/shared_parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace selfcal::discovery {
namespace {

constexpr int drift_y = 4, scale_x = 15;

// Of sigma 1 each, without laws.
LawFit two_recordings() {
  LawFit fit;
  fit.coefficient.resize(0);
  fit.covariance.resize(0, 0);
  for (int r = 0; r < 2; ++r) {
    FittedRecording one;
    one.covariance_alone = one.covariance = ParameterMatrix::Identity();
    one.shift = Eigen::MatrixXd::Zero(sensor_parameter_count, 0);
    fit.recordings.push_back(one);
  }
  return fit;
}

TEST(SharedParameters, EqualOnesAreTheMeanWithHalfTheVariance) {
  LawFit fit = two_recordings();
  fit.recordings[0].parameters(scale_x) = 1.0;
  fit.recordings[1].parameters(scale_x) = 2.0;
  fit.recordings[1].covariance_alone(scale_x, scale_x) = 3.0;
  const SharedParameters shared = share_parameters(fit);
  EXPECT_TRUE(shared.lasting_shared);
  EXPECT_TRUE(shared.biases_shared);
  EXPECT_TRUE(shared.differing.empty());
  for (const int r : {0, 1}) {  // weights 1 and 1/3
    EXPECT_NEAR(shared.parameters[static_cast<std::size_t>(r)](scale_x), (1.0 + 2.0 / 3.0) / (4.0 / 3.0), 1e-12);
    EXPECT_NEAR(shared.covariance[static_cast<std::size_t>(r)](scale_x, scale_x), 0.75, 1e-12);
    EXPECT_NEAR(shared.covariance[static_cast<std::size_t>(r)](drift_y, drift_y), 0.5, 1e-12);
  }
}

// A switched-on unit has a new drift: its scale factors are shared all the same, and the drifts stay as they are.
TEST(SharedParameters, ANewTurnOnBiasIsToldAndLeftFree) {
  LawFit fit = two_recordings();
  fit.recordings[1].parameters(drift_y) = -12.0;
  fit.recordings[1].parameters(scale_x) = 1.0;
  const SharedParameters shared = share_parameters(fit);
  EXPECT_TRUE(shared.lasting_shared);
  EXPECT_FALSE(shared.biases_shared);
  ASSERT_EQ(shared.differing.size(), 1U);
  EXPECT_EQ(shared.differing[0].parameter, drift_y);
  EXPECT_EQ(shared.differing[0].recording, 1U);
  EXPECT_NEAR(shared.differing[0].difference, -12.0, 1e-12);
  EXPECT_NEAR(shared.differing[0].sigma, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(shared.parameters[0](scale_x), 0.5, 1e-12);
  EXPECT_NEAR(shared.parameters[0](drift_y), 0.0, 1e-12);
  EXPECT_NEAR(shared.parameters[1](drift_y), -12.0, 1e-12);
}

// 6 differences of sigma sqrt(2), one of which is 3 sqrt(2): the tail of chi-squared(6) at 9 is
// exp(-9/2) (1 + 9/2 + (9/2)^2/2).
TEST(SharedParameters, ThePValueIsThatOfChiSquared) {
  LawFit fit = two_recordings();
  fit.recordings[1].parameters(drift_y) = 3.0 * std::sqrt(2.0);
  const SharedParameters shared = share_parameters(fit);
  EXPECT_NEAR(std::exp(shared.log_p_biases), std::exp(-4.5) * (1.0 + 4.5 + 4.5 * 4.5 / 2.0), 1e-9);
  EXPECT_NEAR(shared.log_p_lasting, 0.0, 1e-12);
}

// The second recording alone sees the law's coefficient through a scale factor that the first one knows: sharing tells it.
// theta_2 = theta_20 + c with var(c) = 4; var(theta_1) = var(theta_20) = 1. Given theta_2 = theta_1, of d = theta_2 - theta_1
// with variance 6, c moves by -cov(c, d)/6 d = -4/6 d, and its variance falls to 4 - 16/6.
TEST(SharedParameters, WhatIsSharedTellsOfTheLaw) {
  LawFit fit = two_recordings();
  fit.coefficient = Eigen::VectorXd::Constant(1, 5.0);
  fit.covariance = Eigen::MatrixXd::Constant(1, 1, 4.0);
  for (FittedRecording& r : fit.recordings) {
    r.shift = Eigen::MatrixXd::Zero(sensor_parameter_count, 1);
  }
  fit.recordings[1].shift(scale_x, 0) = 1.0;
  fit.recordings[1].parameters(scale_x) = 1.5;
  const SharedParameters shared = share_parameters(fit);
  ASSERT_TRUE(shared.lasting_shared);
  EXPECT_NEAR(shared.coefficient(0), 5.0 - 4.0 / 6.0 * 1.5, 1e-12);
  EXPECT_NEAR(shared.coefficient_covariance(0, 0), 4.0 - 16.0 / 6.0, 1e-12);
  EXPECT_NEAR(shared.parameters[0](scale_x), shared.parameters[1](scale_x), 1e-12);
}

TEST(SharedParameters, OneRecordingStaysAsItIs) {
  LawFit fit = two_recordings();
  fit.recordings.pop_back();
  fit.recordings[0].parameters(drift_y) = 7.0;
  const SharedParameters shared = share_parameters(fit);
  ASSERT_EQ(shared.parameters.size(), 1U);
  EXPECT_EQ(shared.parameters[0](drift_y), 7.0);
}

}  // namespace
}  // namespace selfcal::discovery
