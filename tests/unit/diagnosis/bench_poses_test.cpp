// Sensors in SI on a bench: faces of a cube, a rate table, a chamber. What they see of the Earth and what follows the temperature.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double dt = 0.01, latitude = 0.84, gravity = 9.8085, earth_rate = 7.292115e-5;
const std::array<Vector3, 6> faces = {Vector3(0, 0, 1),  Vector3(0, 0, -1), Vector3(1, 0, 0),
                                      Vector3(-1, 0, 0), Vector3(0, 1, 0),  Vector3(0, -1, 0)};

// Truth by integration of the turns; n = north, up, east. Noise of a sample is white.
struct Bench {
  PoseInput input;
  std::mt19937 random;
  std::normal_distribution<double> normal;
  Matrix3 C_nb = Matrix3::Identity();
  double gyro_noise = 2e-3, force_noise = 5e-3;  // of a consumer's MEMS, rad/s and m/s^2
  Vector3 gyro_bias = Vector3(1e-5, -2e-5, 3e-5), force_bias = Vector3(0.02, -0.01, 0.03);
  Matrix3 G = Matrix3::Zero();                // rad/s per g
  Matrix3 gyro_matrix = Matrix3::Identity();  // what is read of what is
  Matrix3 force_matrix = Matrix3::Identity();
  double temperature = 25.0;
  Vector3 gyro_per_degree = Vector3::Zero(), bias_per_degree = Vector3::Zero(), scale_per_degree = Vector3::Zero();

  explicit Bench(std::uint32_t seed) : random(seed) {
    input.accel_unit = 1.0;
    input.gravity = gravity;
    input.latitude = latitude;
  }
  Vector3 noise(double sigma) { return sigma * Vector3(normal(random), normal(random), normal(random)); }
  void sample(const Vector3& rate) {
    C_nb = C_nb * matrix_from_rotation_vector(rate * dt);
    const Vector3 f = C_nb.transpose() * Vector3(0.0, gravity, 0.0);
    const Vector3 earth = earth_rate * (C_nb.transpose() * Vector3(std::cos(latitude), std::sin(latitude), 0.0));
    const double warm = temperature - 25.0;
    const Vector3 gyro =
        gyro_matrix * (rate + earth) + gyro_bias + G * f / gravity + warm * gyro_per_degree + noise(gyro_noise);
    const Vector3 force = force_matrix * f + force_bias + warm * (bias_per_degree + scale_per_degree.cwiseProduct(f)) +
                          noise(force_noise);
    input.time_s.push_back(dt * static_cast<double>(input.time_s.size() + 1));
    input.gyro.push_back({gyro.x(), gyro.y(), gyro.z()});
    input.accel.push_back({force.x(), force.y(), force.z()});
  }
  void rest(double seconds) {
    for (int k = 0; k < std::lround(seconds / dt); ++k) {
      sample(Vector3::Zero());
    }
  }
  // Within three seconds to the attitude in which `up` points upwards.
  void turn_to(const Vector3& up) {
    const Vector3 now = C_nb.row(1).transpose();
    Vector3 axis = up.cross(now);
    axis = axis.norm() > 1e-3 ? Vector3(axis.normalized()) : Vector3(now.unitOrthogonal());
    const double angle = std::atan2(up.cross(now).norm(), up.dot(now));
    for (int k = 0; k < 300; ++k) {
      sample(axis * (angle / 3.0) * (1.0 - std::cos(2.0 * M_PI * (k + 0.5) / 300.0)));
    }
  }
  Vector3 tilted(const Vector3& face, double sigma) { return (face + noise(sigma)).normalized(); }
  Vector3 anywhere() { return noise(1.0).normalized(); }
};

// Noise of fibre gyros and quartz accelerometers: means over 20 s are known to 0.16 deg/h, where the Earth makes 15.
Bench navigation_grade(std::uint32_t seed) {
  Bench b(seed);
  b.gyro_noise = 3.5e-5;
  b.force_noise = 4e-3;
  return b;
}

TEST(BenchPoses, TheEarthsRateIsNoGSensitivity) {
  Bench b = navigation_grade(1);
  for (const int k : {0, 2, 1, 3, 4, 5, 0}) {
    b.turn_to(b.tilted(faces[static_cast<std::size_t>(k)], 0.01));
    b.rest(20.0);
  }
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_TRUE(d.gyro_named.empty());
  EXPECT_TRUE(d.earth_taken_out);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Sigma is that of seven poses: Student's t of six degrees of freedom exceeds 6 in a draw of a thousand.
    EXPECT_LT(std::abs(d.gyro_bias[axis] - b.gyro_bias(static_cast<Eigen::Index>(axis))),
              6.0 * d.gyro_bias_sigma[axis]);
    EXPECT_LT(d.gyro_bias_sigma[axis], 1.0 * units::degree_per_hour);
  }
  b.input.latitude.reset();  // its size is known everywhere
  const PoseDiagnosis anywhere = diagnose_poses(b.input, 0.01);
  EXPECT_TRUE(anywhere.gyro_named.empty());
  EXPECT_TRUE(anywhere.earth_taken_out);
  ASSERT_TRUE(anywhere.latitude_seen);
  EXPECT_NEAR(*anywhere.latitude_seen, latitude, 3.0 * units::degree);  // 1 deg/h beside 15
  EXPECT_LT(std::abs(*anywhere.latitude_seen - latitude), 5.0 * anywhere.latitude_seen_sigma);
  b.input.gyros_si = false;  // the turns tell that they are rad/s
  EXPECT_TRUE(diagnose_poses(b.input, 0.01).earth_taken_out);
  b.input.gyros_si = true;  // the negative control: 11 deg/h go with the pose, of gyros that read 50 times as much
  for (std::array<double, 3>& rate : b.input.gyro) {
    rate = {50.0 * rate[0], 50.0 * rate[1], 50.0 * rate[2]};
  }
  const PoseDiagnosis unknown = diagnose_poses(b.input, 0.01);
  EXPECT_FALSE(unknown.earth_taken_out);
  EXPECT_GT(unknown.gyro_bias_sigma[0], 50.0 * 10.0 * d.gyro_bias_sigma[0]);
}

// One turn was left out, so that no heading is known through it: what depends on the pose within 15 deg/h is told with the Earth's rate as its rival.
TEST(BenchPoses, WithoutAHeadingTheEarthsRateIsARival) {
  Bench b = navigation_grade(1);
  b.G = 9.0 * units::degree_per_hour * Matrix3{{0.0, 1.0, 1.0}, {1.0, 0.0, -1.0}, {-1.0, 1.0, 0.0}};
  for (int k = 0; k < 30; ++k) {
    b.turn_to(b.anywhere());
    b.rest(20.0);
  }
  for (std::size_t i = b.input.time_s.size() / 2; i < b.input.time_s.size(); ++i) {
    b.input.time_s[i] += 100.0;
  }
  b.input.latitude.reset();
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  EXPECT_FALSE(d.earth_taken_out);
  EXPECT_FALSE(d.gyro_named.empty());
  for (const PoseEffect& e : d.gyro_named) {
    EXPECT_TRUE(e.may_be_earth || !e.effect->linear_in_force) << e.effect->id;
  }
}

// As of a log in which an axis that points up reads -g: the bias of the gyros is the same, and the reason is said.
TEST(BenchPoses, TheEarthsRateTellsAccelerometersThatAreReversed) {
  Bench b = navigation_grade(1);
  for (const int k : {0, 2, 1, 3, 4, 5, 0}) {
    b.turn_to(b.tilted(faces[static_cast<std::size_t>(k)], 0.01));
    b.rest(20.0);
  }
  EXPECT_FALSE(diagnose_poses(b.input, 0.01).accel_reversed);
  for (std::array<double, 3>& f : b.input.accel) {
    f = {-f[0], -f[1], -f[2]};
  }
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  EXPECT_TRUE(d.accel_reversed);
  EXPECT_TRUE(d.gyro_named.empty());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_LT(std::abs(d.gyro_bias[axis] - b.gyro_bias(static_cast<Eigen::Index>(axis))),
              6.0 * d.gyro_bias_sigma[axis]);
  }
}

TEST(BenchPoses, AGSensitivityIsNamedBesideTheEarthsRate) {
  Bench b = navigation_grade(2);
  b.G << 0.0, 4.0, 0.0, 0.0, 0.0, -3.0, 5.0, 0.0, 0.0;  // deg/h/g
  b.G *= units::degree_per_hour;
  for (int k = 0; k < 16; ++k) {
    b.turn_to(b.anywhere());
    b.rest(20.0);
  }
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  ASSERT_EQ(d.gyro_named.size(), 1u);
  EXPECT_EQ(d.gyro_named[0].effect->id, "gyro_g_sensitivity");
  for (int k = 0; k < 9; ++k) {
    // A heading that the g-sensitivity leads astray by 0.1 rad leaves 1 deg/h.
    EXPECT_NEAR(d.gyro_named[0].value[static_cast<std::size_t>(k)] / units::degree_per_hour,
                b.G(k / 3, k % 3) / units::degree_per_hour, 1.0);
  }
}

// A rate table about the vertical: steps to both sides, as long as the rests before and behind them.
Bench rate_table(std::uint32_t seed, std::vector<double>& angle) {
  Bench b(seed);
  b.gyro_matrix(1, 1) = 1.002;
  double at = 0.0;
  b.rest(10.0);
  for (const double rate : {10.0, -10.0, 50.0, -50.0, 200.0, -200.0, 400.0, -400.0}) {
    for (int k = 0; k < 1000; ++k) {
      b.sample(Vector3(0.0, rate * units::degree, 0.0));
    }
  }
  b.rest(10.0);
  for (std::size_t k = 0; k < b.input.time_s.size(); ++k) {
    const std::size_t step = k / 1000;
    constexpr std::array<double, 10> rates = {0, 10, -10, 50, -50, 200, -200, 400, -400, 0};
    at += rates.at(step) * units::degree * dt;
    angle.push_back(at);
  }
  return b;
}

TEST(BenchPoses, SteadyRatesAreNoPoses) {
  std::vector<double> angle;
  const Bench b = rate_table(3, angle);
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 2);
  EXPECT_EQ(d.steady_turns, 8);
  EXPECT_TRUE(d.gyro_parameters.empty());
}

TEST(BenchPoses, AnEncoderThatBeginsAgainAtAFullTurn) {
  std::vector<double> angle;
  Bench b = rate_table(4, angle);
  for (double& a : angle) {
    a -= 2.0 * M_PI * std::floor(a / (2.0 * M_PI));
  }
  b.input.outer = angle;
  b.input.inner.assign(angle.size(), 0.0);
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  ASSERT_TRUE(d.read_outs && d.read_outs->axes.size() == 1);
  const ReadOutAxis& axis = d.read_outs->axes.front();
  EXPECT_EQ(axis.rows, 8);
  EXPECT_NEAR(axis.fastest_deg_per_s, 400.0, 0.1);
  // White noise of a step's mean, 2e-3 rad/s / sqrt(800), over 400 deg/s: 1e-5.
  EXPECT_NEAR(axis.response.y(), 1.002, 6e-5);
  EXPECT_FALSE(axis.nonlinearity && axis.nonlinearity->determined);
}

// Six faces at five temperatures of a chamber, 15 s each; the channel has 0.01 degC.
Bench chamber(std::uint32_t seed, bool follows) {
  Bench b(seed);
  b.force_noise = 2e-3;
  if (follows) {
    b.gyro_per_degree = Vector3(0.004, -0.007, 0.002) * units::degree;
    b.bias_per_degree = Vector3(200.0, -100.0, 50.0) * units::micro_g;
    b.scale_per_degree = Vector3(60.0, -40.0, 20.0) * units::ppm;
  }
  for (const double temperature : {-20.0, 0.0, 25.0, 45.0, 60.0}) {
    b.temperature = temperature;
    for (const Vector3& face : faces) {
      b.turn_to(b.tilted(face, 0.005));
      b.rest(15.0);
      b.input.temperature_c.resize(b.input.time_s.size(), temperature + 0.01 * b.normal(b.random));
    }
  }
  return b;
}

TEST(BenchPoses, WhatFollowsAMeasuredTemperature) {
  const Bench b = chamber(5, true);
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_TRUE(d.has_temperature);
  EXPECT_TRUE(d.accel_adequate);
  EXPECT_FALSE(d.settling);
  ASSERT_EQ(d.accel_named.size(), 2u);
  for (const PoseEffect& p : d.accel_named) {
    ASSERT_TRUE(p.effect->id == "accel_temperature" || p.effect->id == "accel_scale_temperature");
    const Vector3 truth = p.effect->id == "accel_temperature" ? b.bias_per_degree : b.scale_per_degree;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_LT(std::abs(p.value[axis] - truth(static_cast<Eigen::Index>(axis))), 5.0 * p.sigma[axis])
          << p.effect->id << " " << axis << ": " << p.value[axis] << " +- " << p.sigma[axis] << " of "
          << truth(static_cast<Eigen::Index>(axis));
      EXPECT_LT(p.sigma[axis], 0.05 * truth.cwiseAbs().maxCoeff());
    }
  }
  // The bias is that at the mean of the poses' temperatures, 22 degC.
  const Vector3 bias = b.force_bias - 3.0 * b.bias_per_degree;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_LT(std::abs(d.accel_parameters[axis].value - bias(static_cast<Eigen::Index>(axis))),
              5.0 * d.accel_parameters[axis].sigma);
  }
  ASSERT_EQ(d.gyro_named.size(), 1u);
  EXPECT_EQ(d.gyro_named[0].effect->id, "gyro_temperature");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_LT(std::abs(d.gyro_named[0].value[axis] - b.gyro_per_degree(static_cast<Eigen::Index>(axis))),
              5.0 * d.gyro_named[0].sigma[axis]);
  }
}

TEST(BenchPoses, NothingFollowsATemperatureThatChangesNothing) {
  const PoseDiagnosis d = diagnose_poses(chamber(6, false).input, 0.01);
  EXPECT_TRUE(d.has_temperature);
  EXPECT_TRUE(d.accel_named.empty());
  EXPECT_TRUE(d.gyro_named.empty());
  EXPECT_TRUE(d.accel_adequate);
  EXPECT_FALSE(d.settling);
}

TEST(BenchPoses, WithoutItsChannelAChamberIsAMisfit) {
  Bench b = chamber(7, true);
  b.input.temperature_c.clear();
  EXPECT_FALSE(diagnose_poses(b.input, 0.01).accel_adequate);
}

TEST(BenchPoses, ScaleFactorsAreThoseOfTheGravityOfTheSite) {
  Bench b(8);
  for (int k = 0; k < 18; ++k) {
    b.turn_to(b.anywhere());
    b.rest(5.0);
  }
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  for (std::size_t k = 3; k < 6; ++k) {
    EXPECT_LT(std::abs(d.accel_parameters[k].value), 5.0 * d.accel_parameters[k].sigma);
    EXPECT_LT(d.accel_parameters[k].sigma, 1e-4);  // against standard gravity they would read 1.9e-4
  }
}

// Faces alone leave the accelerometers' misalignments open, and with them the directions that gyros are held against.
TEST(BenchPoses, MisalignmentsOfGyrosHoldWhatFacesLeaveOpen) {
  Bench b(9);
  b.gyro_noise = 2e-4;
  b.force_matrix(0, 1) = 0.005;
  b.force_matrix(1, 2) = -0.005;
  for (int round = 0; round < 4; ++round) {
    for (const Vector3& face : faces) {
      b.turn_to(b.tilted(face, 0.001));
      b.rest(8.0);
    }
  }
  const PoseDiagnosis d = diagnose_poses(b.input, 0.01);
  ASSERT_FALSE(d.gyro_parameters.empty());
  for (const PoseParameter& p : d.gyro_parameters) {
    EXPECT_LT(std::abs(p.value), 3.0 * p.sigma) << p.name;
  }
}

// 24 positions of a cube in a fixture that is good to 0.1 deg: six sizes of gravity and six of the nine parameters. A cubic part differs from a
// scale factor by the square of the tilt alone.
TEST(BenchPoses, FacesOfACubeShowNoCubicPart) {
  for (const std::uint32_t seed : {10U, 11U, 12U}) {
    Bench b(seed);
    b.force_matrix(0, 1) = 5e-4;
    for (int round = 0; round < 4; ++round) {
      for (const Vector3& face : faces) {
        b.turn_to(b.tilted(face, 0.0017));
        b.rest(8.0);
      }
    }
    EXPECT_TRUE(diagnose_poses(b.input, 0.01).accel_adequate) << "seed " << seed;
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
