// What remains beside a name: the noise is fitted again, and a place is laid at the name's door only where the name makes
// something there.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/diagnosis/search/locate.hpp"

namespace selfcal::diagnosis {
namespace {

using Densities = std::array<double, 9>;  // angle random walk, velocity random walk, integral; of x, y, z each
constexpr Densities start = {1e-6, 2e-6, 1.5e-6, 4e-5, 3e-5, 5e-5, 3e-5, 2e-5, 6e-5};

NoiseModel with(const Densities& d) {
  NoiseModel noise;
  noise.axes = {Vector3(d[0], d[1], d[2]), Vector3(d[3], d[4], d[5]), Vector3(d[6], d[7], d[8])};
  return noise;
}

Densities densities(const NoiseModel& noise) {
  const Vector3 &g = noise.axes->gyro_arw, &a = noise.axes->accel_vrw, &v = noise.axes->accel_integral;
  return {g(0), g(1), g(2), a(0), a(1), a(2), v(0), v(1), v(2)};
}

// Log likelihood with its top at `top`; the densities' logarithms are known to 1/100 and independent.
double likelihood(const NoiseModel& noise, const Densities& top) {
  const Densities d = densities(noise);
  double sum = 0.0;
  for (std::size_t k = 0; k < d.size(); ++k) {
    const double off = std::log(d[k] / top[k]) / 0.01;
    sum -= 0.5 * off * off;
  }
  return sum;
}

// The last steps are of 6 %: half of one remains at most where the densities do not hang together.
TEST(RefitVelocityNoise, GoesToTheTop) {
  Densities top = start;
  top[0] /= 1.67;  // one axis of each kind
  top[4] *= 1.16;
  top[8] *= 1.06;
  const auto refitted =
      refit_velocity_noise(with(start), [&](const NoiseModel& trial) { return likelihood(trial, top); });
  ASSERT_TRUE(refitted);
  const Densities found = densities(*refitted);
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_LT(std::abs(std::log(found[k] / top[k])), 0.501 * std::log(1.06)) << k;
  }
  // Of a triad the filter is told the root of the mean square.
  EXPECT_DOUBLE_EQ(refitted->gyro_arw, std::sqrt(refitted->axes->gyro_arw.squaredNorm() / 3.0));
  EXPECT_DOUBLE_EQ(refitted->accel_vrw, std::sqrt(refitted->axes->accel_vrw.squaredNorm() / 3.0));
}

TEST(RefitVelocityNoise, StaysAtTheTop) {
  EXPECT_FALSE(refit_velocity_noise(with(start), [](const NoiseModel& trial) { return likelihood(trial, start); }));
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
