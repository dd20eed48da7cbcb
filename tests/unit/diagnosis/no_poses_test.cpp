// What is as quiet as a pose and none, made here: a drive, a centrifuge, acceleration without gravity; logs with gaps; units that nobody says.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 50.0, dt = 1.0 / rate_hz, g = 9.80665;
constexpr double gyro_sigma = 5e-4, accel_sigma = 5e-3;  // rad/s and m/s^2, white, of a sample

struct Log {
  PoseInput input;
  std::mt19937 random;
  std::normal_distribution<double> normal;
  Vector3 u = Vector3(0.0, 0.0, 1.0);  // up, in the sensor
  Vector3 gyro_bias = Vector3(0.002, -0.001, 0.003), accel_bias = Vector3(0.05, -0.1, 0.02);
  double per_g = g, time_s = 0.0;  // accelerometers: raw units of 1 g

  explicit Log(std::uint32_t seed, bool si = true) : random(seed), per_g(si ? g : 4096.0) {
    input.accel_unit = si ? 1.0 : 0.0;
    input.gyros_si = si;
  }
  Vector3 noise(double sigma) { return sigma * Vector3(normal(random), normal(random), normal(random)); }
  void sample(const Vector3& rate, const Vector3& acceleration = Vector3::Zero(), double gravity = 1.0) {
    u = matrix_from_rotation_vector(-rate * dt) * u;
    time_s += dt;
    const Vector3 w = rate + gyro_bias + noise(gyro_sigma);
    const Vector3 f = (gravity * g * u + acceleration + accel_bias + noise(accel_sigma)) * per_g / g;
    input.time_s.push_back(time_s);
    input.gyro.push_back({w.x(), w.y(), w.z()});
    input.accel.push_back({f.x(), f.y(), f.z()});
  }
  void stand(double seconds, double gravity = 1.0) {
    for (int k = 0; k < static_cast<int>(seconds * rate_hz); ++k) {
      sample(Vector3::Zero(), Vector3::Zero(), gravity);
    }
  }
  // By 1.9 rad in 2 s, with the jerks of a hand.
  void turn(const Vector3& axis, double gravity = 1.0) {
    const int n = static_cast<int>(2.0 * rate_hz);
    for (int k = 0; k < n; ++k) {
      const double phase = 2.0 * std::numbers::pi * (k + 0.5) / n;
      sample(axis.normalized() * 0.95 * (1.0 - std::cos(phase)),
             2.0 * Vector3(std::sin(phase), std::sin(2 * phase), 0.0), gravity);
    }
  }
  Vector3 some_axis() { return noise(1.0); }
};

bool says(const PoseDiagnosis& d, const std::string& words) {
  return std::any_of(d.invisible.begin(), d.invisible.end(),
                     [&](const std::string& said) { return said.find(words) != std::string::npos; });
}

// Yaw of some 8 deg/s and pushes of 0.1 g that change within seconds, for ten minutes.
void drive(Log& log, double seconds) {
  double yaw = 0.0, push = 0.0;
  for (int k = 0; k < static_cast<int>(seconds * rate_hz); ++k) {
    yaw += -yaw * dt / 3.0 + 0.14 * std::sqrt(2.0 * dt / 3.0) * log.normal(log.random);
    push += -push * dt / 2.0 + 1.0 * std::sqrt(2.0 * dt / 2.0) * log.normal(log.random);
    log.sample(Vector3(0.0, 0.0, yaw), Vector3(push, 12.0 * yaw, 0.0));
  }
}

TEST(NoPoses, ADriveIsNoPose) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    Log log(seed);
    drive(log, 300.0);
    const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
    EXPECT_NE(d.failure.find("nowhere rests"), std::string::npos) << d.failure << d.poses;
  }
}

TEST(NoPoses, AStandBeforeADriveIsThePoseThatThereIs) {
  Log log(4);
  log.stand(15.0);
  drive(log, 500.0);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.rest);
  EXPECT_LT(d.static_seconds, 16.0);
  EXPECT_GT(d.static_seconds, 12.0);
  for (const RestAxis& a : d.rest->axes) {
    if (a.gyro) {
      EXPECT_NEAR(a.mean, log.gyro_bias(a.axis), 5.0 * a.mean_sigma);
      EXPECT_LT(a.mean_sigma, 5e-4);  // white noise of 12 s: 2e-5 rad/s
    }
  }
}

// 1.3 to 4 g, by a steady turn that accelerometers alone do not see.
TEST(NoPoses, ACentrifugeIsNoPose) {
  Log log(5);
  log.input.sensors = Sensors::accelerometers;
  for (const double level : {1.0, 1.4, 1.8, 2.3, 2.9, 3.5, 4.0, 1.0}) {
    log.stand(20.0, level);
    for (int k = 0; k < 100; ++k) {
      log.sample(Vector3::Zero(), Vector3(std::sin(0.3 * k), 0.5, 0.0), level);
    }
  }
  std::fill(log.input.gyro.begin(), log.input.gyro.end(), std::array<double, 3>{});
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 2);
  EXPECT_FALSE(d.by_poses);
  EXPECT_EQ(d.other_forces.size(), 6u);
  EXPECT_TRUE(says(d, "steady acceleration"));
}

TEST(NoPoses, AccelerationWithoutGravityIsNoReference) {
  for (const bool si : {true, false}) {
    Log log(6, si);
    log.input.sensors = Sensors::accelerometers;
    constexpr double left = 0.01;  // of gravity: what the phone's own calibration leaves
    for (int k = 0; k < 14; ++k) {
      log.stand(6.0, left);
      log.turn(log.some_axis(), left);
    }
    std::fill(log.input.gyro.begin(), log.input.gyro.end(), std::array<double, 3>{});
    const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
    EXPECT_NE(d.failure.find("gravity is not"), std::string::npos) << d.failure << si;
  }
}

Log poses(std::uint32_t seed, int count, bool si = true) {
  Log log(seed, si);
  for (int k = 0; k < count; ++k) {
    log.stand(8.0);
    log.turn(log.some_axis());
  }
  log.stand(8.0);
  return log;
}

const PoseParameter& parameter(const PoseDiagnosis& d, const std::string& name) {
  return *std::find_if(d.accel_parameters.begin(), d.accel_parameters.end(),
                       [&](const PoseParameter& p) { return p.name == name; });
}

// Nobody knows what it did while 20 s lack of a turn: that turn is left out, and the others are as good as ever.
TEST(Gaps, ATurnWithAGapIsLeftOut) {
  Log log = poses(7, 14);
  const std::size_t from = log.input.time_s.size() / 2 - log.input.time_s.size() / 2 % 500 + 425,
                    count = 50;  // in a turn
  for (auto* series : {&log.input.gyro, &log.input.accel}) {
    series->erase(series->begin() + static_cast<std::ptrdiff_t>(from),
                  series->begin() + static_cast<std::ptrdiff_t>(from + count));
  }
  log.input.time_s.erase(log.input.time_s.begin() + static_cast<std::ptrdiff_t>(from),
                         log.input.time_s.begin() + static_cast<std::ptrdiff_t>(from + count));
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 15);
  EXPECT_EQ(d.turns, 13);
  ASSERT_EQ(d.left_out.size(), 1u);
  EXPECT_EQ(d.left_out.front().samples, 0u);
  EXPECT_LT(d.direction_before, 0.3 * units::degree);  // a lost half turn leaves a radian in one turn of 14
}

// Switched off for two minutes in the middle: each time it is switched on the bias is another. No drift.
TEST(Gaps, ABiasThatJumpsAtAGapIsNoDrift) {
  for (const std::uint32_t seed : {8U, 9U, 10U}) {
    Log log = poses(seed, 9);
    const double gap_s = log.time_s;
    log.time_s += 120.0;
    const Vector3 jump = Vector3(4e-3, -3e-3, 2e-3);
    log.gyro_bias += jump;
    for (int k = 0; k < 9; ++k) {
      log.turn(log.some_axis());
      log.stand(8.0);
    }
    const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
    ASSERT_TRUE(d.failure.empty()) << d.failure;
    EXPECT_TRUE(d.gyro_named.empty());
    ASSERT_EQ(d.gyro_jumps.size(), 1u);
    EXPECT_NEAR(d.gyro_jumps.front().time_s, gap_s + 120.0, 5.0);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(d.gyro_jumps.front().size(axis), jump(axis), 5.0 * d.gyro_jumps.front().sigma(axis));
    }
  }
}

TEST(Gaps, NoJumpNoWord) {
  Log log = poses(11, 9);
  log.time_s += 120.0;
  for (int k = 0; k < 9; ++k) {
    log.turn(log.some_axis());
    log.stand(8.0);
  }
  EXPECT_TRUE(diagnose_poses(log.input, 0.01).gyro_jumps.empty());
}

// Gravity of 9.78 to 9.83 m/s^2: of a place that nobody says the three scale factors are off together.
TEST(Gravity, OfAnUnknownPlaceIsInTheSigmaOfAScaleFactor) {
  Log log = poses(12, 14);
  log.input.gravity = 9.8200;  // the log's own is 9.80665
  log.input.gravity_sigma = 0.015;
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  for (const char* name : {"scale_x", "scale_y", "scale_z"}) {
    EXPECT_LT(std::abs(parameter(d, name).value), 3.0 * parameter(d, name).sigma) << name;
    EXPECT_GT(parameter(d, name).sigma, 0.015 / 9.82);
  }
  log.input.gravity_sigma = 0.0;
  EXPECT_GT(std::abs(parameter(diagnose_poses(log.input, 0.01), "scale_x").value), 1e-3);
}

// Counts that nobody says the worth of: what is seen is how many of them are 1 g.
TEST(Gravity, CountsAreToldPerG) {
  const Log log = poses(13, 14, false);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  for (const char* name : {"scale_x", "scale_y", "scale_z"}) {
    EXPECT_EQ(parameter(d, name).unit, "raw/g");
    EXPECT_NEAR(parameter(d, name).value, 4096.0, 5.0 * parameter(d, name).sigma) << name;
    EXPECT_LT(parameter(d, name).sigma, 2.0);
  }
}

// Accelerometers in SI beside gyros in counts: what rests is told in raw units of both.
TEST(Units, OneTriadInSIMakesNoSIOfTheOther) {
  Log log(14);
  log.input.gyros_si = false;
  log.stand(60.0);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  EXPECT_FALSE(d.rest->si);
}

// One gyro of three.
TEST(OneAxis, IsAnsweredAlone) {
  Log log(15);
  log.input.sensors = Sensors::gyros;
  log.input.gyro_axes = {false, true, false};
  log.stand(120.0);
  for (std::size_t i = 0; i < log.input.gyro.size(); ++i) {
    log.input.gyro[i] = {0.0, log.input.gyro[i][1], 0.0};
    log.input.accel[i] = {};
  }
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.rest);
  ASSERT_EQ(d.rest->axes.size(), 1u);
  EXPECT_EQ(d.rest->axes.front().axis, 1);
  EXPECT_NEAR(d.rest->axes.front().mean, log.gyro_bias.y(), 5.0 * d.rest->axes.front().mean_sigma);
  EXPECT_NEAR(d.rest->axes.front().white_asd, gyro_sigma * std::sqrt(dt), 0.2 * gyro_sigma * std::sqrt(dt));
}

}  // namespace
}  // namespace selfcal::diagnosis
