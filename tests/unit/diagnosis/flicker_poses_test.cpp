// Drifts of a gyro in poses beside 1/f noise, made of first-order processes an octave apart in time.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/diagnosis/poses/pose_regression.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr int pose_count = 20, pose_s = 20, gap_s = 10;

struct Log {
  std::vector<Pose> poses;
  std::vector<double> time_s;
  Eigen::VectorXd y;
};

// One reading a second: a ramp of `slope` a second over all, and noise of the spectrum variance / (ln 2 f).
Log drawn(double variance, double slope, unsigned seed) {
  constexpr int octaves = 14;
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  std::vector<double> state(octaves);
  for (double& x : state) {
    x = std::sqrt(variance) * normal(engine);
  }
  Log log;
  log.y.resize(pose_count);
  for (int k = 0; k < pose_count; ++k) {
    Pose pose;
    pose.gyro = pose.accel = pose.accel_half = pose.accel_white = pose.u = Vector3::Zero();
    double half[2] = {};
    for (int i = 0; i < pose_s + gap_s; ++i) {
      double reading = slope * (k * (pose_s + gap_s) + i);
      for (int o = 0; o < octaves; ++o) {
        const double kept = std::exp(-1.0 / std::pow(2.0, o));
        double& x = state[static_cast<std::size_t>(o)];
        x = kept * x + std::sqrt((1.0 - kept * kept) * variance) * normal(engine);
        reading += x;
      }
      if (i < pose_s) {
        half[2 * i < pose_s ? 0 : 1] += reading / (0.5 * pose_s);
      }
    }
    pose.length_s = pose_s;
    pose.middle_s = k * (pose_s + gap_s) + 0.5 * pose_s;
    pose.gyro_white = Vector3::Constant(1e-3 * std::sqrt(variance));
    pose.gyro_half = Vector3::Constant(0.5 * (half[1] - half[0]));
    log.y(k) = 0.5 * (half[0] + half[1]);
    log.time_s.push_back(pose.middle_s);
    log.poses.push_back(pose);
  }
  return log;
}

double log_p_of_a_ramp(const Log& log) {
  const Eigen::MatrixXd ones = Eigen::MatrixXd::Ones(pose_count, 1);
  const Eigen::MatrixXd ramp = Eigen::Map<const Eigen::VectorXd>(log.time_s.data(), pose_count) / 600.0;
  return log_p_beside_flicker(log.poses, log.time_s, 0, ones, ramp, log.y);
}

// The level is known from twenty halves, to a third: that widens the tail somewhat.
TEST(FlickerInPoses, MakesADriftAsOftenAsTheTestSays) {
  int below = 0;
  constexpr unsigned draws = 1000;
  for (unsigned seed = 0; seed < draws; ++seed) {
    below += log_p_of_a_ramp(drawn(1.0, 0.0, seed)) < std::log(0.05) ? 1 : 0;
  }
  EXPECT_GT(below, 20);
  EXPECT_LT(below, 120);
}

// Beside white noise the same logs show a ramp far more often than they say: that is why.
TEST(FlickerInPoses, LooksLikeADriftBesideWhiteNoise) {
  int below = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Log log = drawn(1.0, 0.0, seed);
    const Eigen::MatrixXd ramp = Eigen::Map<const Eigen::VectorXd>(log.time_s.data(), pose_count);
    const RowComparison c = compare(Eigen::MatrixXd::Ones(pose_count, 1), ramp, log.y, log.time_s, true);
    below += c.log_p < std::log(0.01) ? 1 : 0;
  }
  EXPECT_GT(below, 20);
}

TEST(FlickerInPoses, HidesNoDriftThatIsLargeBesideIt) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    // 30 sigma of one octave over the log.
    EXPECT_LT(log_p_of_a_ramp(drawn(1.0, 30.0 / (pose_count * (pose_s + gap_s)), seed)), std::log(1e-6));
  }
}

TEST(FlickerInPoses, NoneWhereTheHalvesDifferByWhiteNoise) {
  Log log = drawn(1.0, 0.0, 1);
  for (Pose& pose : log.poses) {
    pose.gyro_white = Vector3::Constant(10.0);
  }
  EXPECT_EQ(log_p_of_a_ramp(log), -HUGE_VAL);
}

}  // namespace
}  // namespace selfcal::diagnosis
