// What remains beside a name: the noise is fitted again, and a place is laid at the name's door only where the name makes
// something there.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/diagnosis/search/locate.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr NoiseDensities start = {1e-6, 4e-5, 3e-5};

NoiseDensities densities(const NoiseModel& noise, const NoiseDensities& of_walk) {
  // The walk's density is seen through the variance that it drives: linear in its sigma.
  const double scale = noise.observation.motion.front().oscillations.front().sigma /
                       with_velocity_noise(noise, of_walk).observation.motion.front().oscillations.front().sigma;
  return {noise.gyro_arw, noise.accel_vrw, scale * of_walk[2]};
}

// Log likelihood with its top at `top`; the densities' logarithms are known to 1/100 and independent.
double likelihood(const NoiseModel& noise, const NoiseDensities& top) {
  const NoiseDensities d = densities(noise, start);
  double sum = 0.0;
  for (std::size_t k = 0; k < d.size(); ++k) {
    const double off = std::log(d[k] / top[k]) / 0.01;
    sum -= 0.5 * off * off;
  }
  return sum;
}

// The last steps are of 6 %: half of one remains at most where the densities do not hang together.
TEST(RefitVelocityNoise, GoesToTheTop) {
  const NoiseDensities top = {start[0] / 1.67, start[1] * 1.16, start[2] * 1.06};
  const auto refitted = refit_velocity_noise(with_velocity_noise({}, start),
                                             [&](const NoiseModel& trial) { return likelihood(trial, top); });
  ASSERT_TRUE(refitted);
  const NoiseDensities found = densities(*refitted, start);
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_LT(std::abs(std::log(found[k] / top[k])), 0.501 * std::log(1.06)) << k;
  }
}

TEST(RefitVelocityNoise, StaysAtTheTop) {
  EXPECT_FALSE(refit_velocity_noise(with_velocity_noise({}, start),
                                    [](const NoiseModel& trial) { return likelihood(trial, start); }));
}

// A base that sways has oscillations of its own in the filter, a still one none: neither is the walk of a quantum.
TEST(RefitVelocityNoise, LeavesOtherNoiseAlone) {
  const auto never = [](const NoiseModel& /*trial*/) -> double {
    ADD_FAILURE() << "asked";
    return 0.0;
  };
  const NoiseModel still;
  EXPECT_FALSE(refit_velocity_noise(still, never));
  NoiseModel moored;
  moored.observation.motion.fill({{{0.6, 50.0, 1e-3}}});
  EXPECT_FALSE(refit_velocity_noise(moored, never));
}

// Columns: two biases, and a signature of length 5 that lies in their plane, beside it, or half in it.
TEST(SquareWithin, IsTheSharePythagorasGives) {
  SignatureRows rows;
  rows.residual = Eigen::VectorXd::Zero(3);
  rows.columns = Eigen::MatrixXd::Zero(3, 5);
  rows.columns.leftCols<2>() << 1.0, 1.0, 0.0, 1.0, 0.0, 0.0;  // not at right angles: what they span counts
  rows.columns.col(2) << 3.0, 4.0, 0.0;
  rows.columns.col(3) << 0.0, 0.0, 5.0;
  rows.columns.col(4) << 0.0, 3.0, 4.0;
  const Evidence evidence(rows);
  const Eigen::VectorXd twice = Eigen::VectorXd::Constant(1, 2.0);
  EXPECT_NEAR(square_within(evidence, {0, 1}, {2}, twice), 4.0 * 25.0, 1e-9);
  EXPECT_NEAR(square_within(evidence, {0, 1}, {3}, twice), 0.0, 1e-9);
  EXPECT_NEAR(square_within(evidence, {0, 1}, {4}, twice), 4.0 * 9.0, 1e-9);
  // Two names that cancel there make nothing.
  EXPECT_NEAR(square_within(evidence, {0, 1}, {2, 2}, Eigen::Vector2d(1.0, -1.0)), 0.0, 1e-9);
  EXPECT_EQ(square_within(evidence, {0, 1}, {}, Eigen::VectorXd()), 0.0);
}

}  // namespace
}  // namespace selfcal::diagnosis
