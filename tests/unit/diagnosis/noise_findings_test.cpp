// The stochastic part against what was assumed, from a check of the noise made by hand.
#include "estimator/diagnosis/noise/noise_findings.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

class NoiseFindings : public testing::Test {
 protected:
  NoiseFindings() {
    assumed_ = {1e-5, 5e-5, 1e-7, 2e-6};
    fitted_.gyro_arw = assumed_.gyro_arw;
    fitted_.accel_vrw = assumed_.accel_vrw;
    calibration_.segments = {{.rotation = false, .start_s = 0.0, .end_s = 3200.0}};
    check_.pieces = enough_noise_pieces;
    for (AxisNoise& axis : check_.axes) {
      axis.increment_variance_sigma = 1e-14;
    }
  }
  std::vector<Finding> found() const { return noise_findings(calibration_, fitted_, check_, assumed_, std::log(1e-3)); }

  AssumedNoise assumed_;
  NoiseModel fitted_;
  NoiseCheck check_;
  CalibrationResult calibration_;
};

// Of 100 pieces of 32 s a density is known to 1/sqrt(2100), 2.2 %, and never better than 3 %: 14 % above are 4.7 sigma, 16 % 5.3.
TEST_F(NoiseFindings, ADensityIsNamedBeyondFiveSigma) {
  EXPECT_TRUE(found().empty());
  fitted_.gyro_arw = 1.14 * assumed_.gyro_arw;
  EXPECT_TRUE(found().empty());
  fitted_.gyro_arw = 1.16 * assumed_.gyro_arw;
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].effect, "gyro_noise_level");
  EXPECT_NEAR(found()[0].significance, 0.16 / 0.03, 1e-3);
  EXPECT_NEAR(found()[0].parameters[0].value, 1.16e-5 / units::degree_per_sqrt_hour, 1e-9);
  EXPECT_TRUE(found()[0].stochastic);
  calibration_.moored = true;  // the motion hides it
  EXPECT_TRUE(found().empty());
}

TEST_F(NoiseFindings, NothingIsSaidOfTooFewPieces) {
  fitted_.accel_vrw = 3.0 * assumed_.accel_vrw;
  EXPECT_EQ(found().size(), 1U);
  check_.pieces = enough_noise_pieces - 1;
  EXPECT_TRUE(found().empty());
}

// A quantum q makes white noise of q/sqrt(12) in the integral.
TEST_F(NoiseFindings, AQuantumIsNamedFromTwiceItsSizeOn) {
  check_.axes[4].increment_sigma = 1.9 * assumed_.accel_quantum / std::sqrt(12.0);
  EXPECT_TRUE(found().empty());
  check_.axes[4].increment_sigma = 2.1 * assumed_.accel_quantum / std::sqrt(12.0);
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].effect, "quantisation");
  EXPECT_EQ(found()[0].parameters[0].name, "accel_y");
  EXPECT_NEAR(found()[0].parameters[0].value, 2.1 * assumed_.accel_quantum, 1e-12);
}

// The beat of the gyros' own quantum q at f is a line of up to 2 f q.
TEST_F(NoiseFindings, ALineIsNamedWhereItIsNoBeat) {
  calibration_.gyro_quantum = 5e-7;
  check_.lines = {{0, 19.0, 1.8e-5, std::log(1e-9)}, {3, 19.0, 1.9e-5, std::log(1e-2)}};
  EXPECT_TRUE(found().empty());  // 2 * 19 * 5e-7 = 1.9e-5 is more; and p of the other is too large
  check_.lines[0].amplitude = 2.0e-5;
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].effect, "vibration_line");
  EXPECT_EQ(found()[0].parameters[0].name, "gyro_x");
}

}  // namespace
}  // namespace selfcal::diagnosis
