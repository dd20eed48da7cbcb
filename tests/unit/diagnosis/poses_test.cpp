// A hand-turned sensor made here with a known g-sensitivity.
#include "estimator/diagnosis/poses/poses.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace selfcal::diagnosis {
namespace {

// 24 poses of 4 s, turned in 2 s about random axes; counts of 2e-4 rad/s and 2.4e-4 g with noise of 4 counts.
// `gyros`, `accelerometers`: what they read of a rate and of a force.
PoseInput hand_turned(const Matrix3& G, std::uint32_t seed, const Matrix3& gyros = Matrix3::Identity(),
                      const Matrix3& accelerometers = Matrix3::Identity()) {
  constexpr double dt = 0.01, gyro_unit = 2e-4, accel_unit = 2.4e-4;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  PoseInput input;
  input.gyro_unit = gyro_unit;
  Vector3 u(0.0, 0.0, 1.0);
  double t = 0.0;
  const auto sample = [&](const Vector3& rate) {
    u = matrix_from_rotation_vector(-rate * dt) * u;
    t += dt;
    const Vector3 gyro = gyros * rate / gyro_unit + Vector3(32500, 32400, 32600) + G * u;
    const Vector3 accel = accelerometers * u / accel_unit + Vector3(33100, 33300, 32400);
    input.time_s.push_back(t);
    input.gyro.push_back({gyro.x() + 4 * normal(random), gyro.y() + 4 * normal(random), gyro.z() + 4 * normal(random)});
    input.accel.push_back(
        {accel.x() + 4 * normal(random), accel.y() + 4 * normal(random), accel.z() + 4 * normal(random)});
  };
  for (int pose = 0; pose < 24; ++pose) {
    for (int k = 0; k < 400; ++k) {
      sample(Vector3::Zero());
    }
    const Vector3 axis = Vector3(normal(random), normal(random), normal(random)).normalized();
    for (int k = 0; k < 200; ++k) {
      sample(axis * 0.9 * (1.0 - std::cos(2.0 * M_PI * (k + 0.5) / 200.0)));
    }
  }
  return input;
}

TEST(Poses, NamesAGSensitivity) {
  Matrix3 G;
  G << 3.0, -8.0, 0.0, 5.0, 0.0, 2.0, 0.0, 6.0, -4.0;  // counts per g
  const PoseDiagnosis d = diagnose_poses(hand_turned(G, 1), 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 24);
  EXPECT_TRUE(d.accel_adequate);
  ASSERT_EQ(d.gyro_named.size(), 1u);
  EXPECT_EQ(d.gyro_named[0].effect->id, "gyro_g_sensitivity");
  ASSERT_EQ(d.gyro_named[0].value.size(), 9u);
  for (int k = 0; k < 9; ++k) {  // nine draws beyond 5 sigma (of 20 degrees): one seed in 2000, and the seed is fixed
    EXPECT_LT(std::abs(d.gyro_named[0].value[static_cast<std::size_t>(k)] - G(k / 3, k % 3)),
              5.0 * d.gyro_named[0].sigma[static_cast<std::size_t>(k)]);
  }
  // 5 counts over 2 s turn gravity by 2 mrad or 0.1 deg; what remains is white noise, 4 counts: 0.01 deg over a turn.
  EXPECT_GT(d.direction_before_held_out, 3.0 * d.direction_after_held_out);
}

// Products of misalignments of 4 % are 1.6e-3 of a scale factor, and a misalignment beside scale factors of 10 % is a tenth larger: what is told
// is the sensors' own matrix, not its inverse with other signs.
TEST(Poses, TellsTheSensorsOwnMatrix) {
  Matrix3 gyros, accelerometers;
  gyros << 1.10, 0.04, -0.03, 0.04, 0.92, 0.035, -0.04, 0.03, 1.05;
  accelerometers << 0.90, 0.04, -0.03, 0.0, 1.08, 0.035, 0.0, 0.0, 0.95;
  const PoseDiagnosis d = diagnose_poses(hand_turned(Matrix3::Zero(), 3, gyros, accelerometers), 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  int told = 0;
  const auto check = [&](const std::vector<PoseParameter>& parameters, const Matrix3& truth, double raw_per_unit) {
    for (const PoseParameter& p : parameters) {
      if (!p.determined || p.name.starts_with("bias")) {
        continue;
      }
      const bool scale = p.name.starts_with("scale_");
      const std::string axes = p.name.substr(p.name.find('_') + 1);
      const int i = axes.front() - 'x', j = axes.back() - 'x';
      const double expected = p.unit == "raw/g" ? truth(i, j) * raw_per_unit
                              : scale           ? truth(i, j) - 1.0
                                                : truth(i, j) / (raw_per_unit > 1.0 ? truth(i, i) : 1.0);
      EXPECT_LT(std::abs(p.value - expected), 5.0 * p.sigma) << p.name << " " << p.value << " of " << expected;
      EXPECT_LT(p.sigma, (p.unit == "raw/g" ? raw_per_unit : 1.0) * 1e-3) << p.name;
      ++told;
    }
  };
  check(d.gyro_parameters, gyros, 1.0);
  // Of counts the misalignments are angles: parts of their own axis's scale factor.
  check(d.accel_parameters, accelerometers, 1.0 / 2.4e-4);
  EXPECT_EQ(told, 15);
}

TEST(Poses, NamesNothingWhereNothingIs) {
  const PoseDiagnosis d = diagnose_poses(hand_turned(Matrix3::Zero(), 2), 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_TRUE(d.accel_adequate);
  EXPECT_TRUE(d.gyro_named.empty());
}

// Counts of a maker may be a thousandth of ug: what is found is the same in any unit.
TEST(Poses, TheSizeOfACountChangesNoTest) {
  PoseInput input = hand_turned(Matrix3::Zero(), 2);
  input.time_s.resize(8000);  // 14 poses: few residuals, where a rank that is one too small is much
  input.gyro.resize(8000);
  input.accel.resize(8000);
  const PoseDiagnosis coarse = diagnose_poses(input, 0.01);
  for (std::array<double, 3>& row : input.accel) {
    for (double& value : row) {
      value *= 65536.0;
    }
  }
  const PoseDiagnosis fine = diagnose_poses(input, 0.01);
  ASSERT_EQ(fine.accel_tried.size(), coarse.accel_tried.size());
  for (std::size_t k = 0; k < fine.accel_tried.size(); ++k) {
    EXPECT_EQ(fine.accel_tried[k].effect, coarse.accel_tried[k].effect);
    // The fit ends where a step is 1e-6 of its sigma, or so.
    EXPECT_NEAR(fine.accel_tried[k].log_p, coarse.accel_tried[k].log_p, 1e-3);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(fine.accel_parameters[k].sigma / 65536.0, coarse.accel_parameters[k].sigma,
                1e-3 * coarse.accel_parameters[k].sigma);
  }
}

TEST(Poses, AnswersFivePosesByRest) {
  PoseInput input = hand_turned(Matrix3::Zero(), 3);
  input.time_s.resize(3000);
  input.gyro.resize(3000);
  input.accel.resize(3000);
  const PoseDiagnosis d = diagnose_poses(input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 5);
  EXPECT_FALSE(d.by_poses);
  ASSERT_TRUE(d.rest);
  EXPECT_FALSE(d.rest->drift_tested);
}

TEST(Poses, RefusesARecordingWithoutPoses) {
  PoseInput input = hand_turned(Matrix3::Zero(), 3);
  input.time_s.resize(900);  // 4 s, 2 s of a turn, 3 s: five blocks, and two constants
  input.gyro.resize(900);
  input.accel.resize(900);
  EXPECT_FALSE(diagnose_poses(input, 0.01).failure.empty());
}

}  // namespace
}  // namespace selfcal::diagnosis
