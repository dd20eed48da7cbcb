// Noise densities found in dwells, against the Cramer-Rao bound of the spectra they are found in.
//
// A periodogram ordinate of density S scatters as S, so a mean over K pieces and three axes carries K 3/2.63 of
// information on ln S (2.63: what the sin^4 window loses, mean(w^4)/mean(w^2)^2 with w = sin^4). With
// S = N^2 + Q^2 h, h = 4 sin^2(pi f D)/D, the information on (N^2, Q^2) is the sum over the band of (1, h)(1, h)^T/S^2
// (Whittle), the band being bins 6 to 26 of 64.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "estimator/geometry/units.hpp"
#include "estimator/models/sensor_noise.hpp"
#include "tests/unit/estimator/motion_data.hpp"
#include "tests/unit/estimator/simulated.hpp"

namespace selfcal {
namespace {

constexpr double rate_hz = 100.0, length_s = 1500.0;
constexpr double arw = 0.001 * units::degree_per_sqrt_hour;
constexpr double vrw = 5.0 * units::micro_g;
constexpr double gyro_group_s = 0.5, accel_group_s = 0.05;

// Relative standard deviations of N and Q.
struct Scatter {
  double white, angle;
};

Scatter cramer_rao(double N, double Q, double group_s, double seconds) {
  const double pieces = std::floor(seconds / (64.0 * group_s)) * 3.0 / 2.63;
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  for (int bin = 6; bin <= 26; ++bin) {
    const double h = 4.0 * std::pow(std::sin(std::numbers::pi * bin / 64.0), 2) / group_s;
    const Eigen::Vector2d row = Eigen::Vector2d(1.0, h) / (N * N + Q * Q * h);
    information += pieces * row * row.transpose();
  }
  const Eigen::Matrix2d covariance = information.inverse();
  return {0.5 * std::sqrt(covariance(0, 0)) / (N * N), 0.5 * std::sqrt(covariance(1, 1)) / (Q * Q)};
}

// Gaussian white rate and white angle, as the model has it, on a base at rest.
SensorNoise estimate_synthetic(std::uint64_t seed, double gyro_angle, double accel_angle) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  const auto noisy = [&](double white, double angle, const Vector3& steady) {
    Vector3 before = Vector3::Zero();
    return [&normal, &engine, white, angle, steady, before](double a, double b) mutable -> Vector3 {
      const auto draw = [&] { return Vector3(normal(engine), normal(engine), normal(engine)); };
      const Vector3 now = angle * draw();
      const Vector3 increment = (b - a) * steady + white * std::sqrt(b - a) * draw() + now - before;
      before = now;
      return increment;
    };
  };
  const test::MotionData data({0.7, 0.0, 0.0}, rate_hz, length_s, noisy(arw, gyro_angle, {5.6e-5, 4.7e-5, 0.0}),
                              noisy(vrw, accel_angle, {0.0, 9.8, 0.0}));
  return estimate_sensor_noise(data.view(), find_segments(data.view()));
}

// Mean and root mean square of (found/true - 1)/scatter over the seeds.
struct Score {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  void add(double found, double truth, double scatter) {
    const double z = (found / truth - 1.0) / scatter;
    sum += z;
    squares += z * z;
    ++count;
  }
  double mean() const { return sum / count; }
  double rms() const { return std::sqrt(squares / count); }
};

TEST(NoiseEstimation, ScattersAsTheCramerRaoBoundAllows) {
  // White angle as strong as white rate in the middle of the band.
  const double gyro_angle = arw * std::sqrt(gyro_group_s / 2.0), accel_angle = vrw * std::sqrt(accel_group_s / 2.0);
  const Scatter gyro = cramer_rao(arw, gyro_angle, gyro_group_s, length_s - 2.0);
  const Scatter accel = cramer_rao(vrw, accel_angle, accel_group_s, length_s - 2.0);
  constexpr int seeds = 32;
  Score gyro_white, gyro_q, accel_white, accel_q, wrong;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {  // seeds 1 to 32
    const SensorNoise found = estimate_synthetic(seed, gyro_angle, accel_angle);
    EXPECT_FALSE(found.base_moves);
    EXPECT_EQ(found.gyro.quantum, 0.0);
    gyro_white.add(found.gyro.white_asd, arw, gyro.white);
    gyro_q.add(found.gyro.increment_sigma, gyro_angle, gyro.angle);
    accel_white.add(found.accel.white_asd, vrw, accel.white);
    accel_q.add(found.accel.increment_sigma, accel_angle, accel.angle);
    wrong.add(found.accel.white_asd, 1.1 * vrw, accel.white);
  }
  // Four sigma of the mean and of the root mean square of `seeds` standard normals; detrending takes a few per cent off
  // the lowest bins, a tenth of a sigma.
  const double mean_bound = 4.0 / std::sqrt(seeds) + 0.1, rms_bound = 4.0 / std::sqrt(2.0 * seeds);
  for (const auto& [name, score] :
       {std::pair{"gyro N", gyro_white}, {"gyro Q", gyro_q}, {"accel N", accel_white}, {"accel Q", accel_q}}) {
    EXPECT_LT(std::abs(score.mean()), mean_bound) << name;
    EXPECT_NEAR(score.rms(), 1.0, rms_bound) << name;
  }
  EXPECT_GT(std::abs(wrong.mean()), mean_bound);  // negative control: ten per cent more noise is another noise
}

// The virtual INS quantises and carries the remainder: the quantum is found exactly, the white part within four sigma.
TEST(NoiseEstimation, FindsNoiseAndQuantumOfTheVirtualIns) {
  for (const double factor : {1.0, 3.0}) {
    sim::SimConfig config;
    config.gyro_arw_deg_per_sqrt_h *= factor;
    config.accel_vrw_ug_per_sqrt_hz *= factor;
    const auto recording = sim::simulate(config, *named_schedule("horizontal", 60.0), 4, {});  // seed 4
    ASSERT_TRUE(recording);
    const ImuData data = test::view_of(*recording);
    const std::vector<Segment> segments = find_segments(data);
    const SensorNoise found = estimate_sensor_noise(data, segments);
    EXPECT_FALSE(found.base_moves);
    // The quantum is the smallest increment over a whole number: exact to the rounding of a product.
    EXPECT_NEAR(found.gyro.quantum / (config.gyro_lsb_arcsec * units::arcsecond), 1.0, 1e-12);
    EXPECT_NEAR(found.accel.quantum / config.accel_lsb_m_per_s, 1.0, 1e-12);
    // One piece a dwell of 60 s for the gyros; carried quanta are uniform, quantum^2/12 of white angle.
    const double white = factor * arw, gyro_angle = config.gyro_lsb_arcsec * units::arcsecond / std::sqrt(12.0);
    const double accel_angle = config.accel_lsb_m_per_s / std::sqrt(12.0);
    const Scatter gyro = cramer_rao(white, gyro_angle, gyro_group_s, 19 * 32.0);
    const Scatter accel = cramer_rao(factor * vrw, accel_angle, accel_group_s, 19 * 57.6);
    EXPECT_NEAR(found.gyro.white_asd / white, 1.0, 4.0 * gyro.white);
    EXPECT_NEAR(found.accel.white_asd / (factor * vrw), 1.0, 4.0 * accel.white);
  }
}

TEST(NoiseEstimation, KnowsAMooredBase) {
  sim::SimConfig config;
  config.base_motion = sim::moored_base_motion();
  const auto recording = sim::simulate(config, *named_schedule("horizontal", 30.0), 5, {});  // seed 5
  ASSERT_TRUE(recording);
  const ImuData data = test::view_of(*recording);
  EXPECT_TRUE(estimate_sensor_noise(data, find_segments(data)).base_moves);
}

}  // namespace
}  // namespace selfcal
