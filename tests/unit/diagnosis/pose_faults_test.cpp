// Logs of hand-turned sensors whose gyros or accelerometers are not what they are called, or do not answer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double dt = 0.01, g = 9.80665;
const Vector3 force_bias(0.004 * g, -0.006 * g, 0.002 * g), rate_bias(0.002, -0.001, 0.0015);

struct Turn {
  Vector3 axis;
  double angle;
};

std::vector<Turn> turns_by_hand(int count, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> angle(0.7, 2.5);
  std::vector<Turn> turns;
  for (int k = 0; k < count; ++k) {
    turns.push_back({Vector3(normal(random), normal(random), normal(random)).normalized(), angle(random)});
  }
  return turns;
}

// z, -z, x, -x, y, -y up, each by the shortest way that a hand with an error of a degree takes.
std::vector<Turn> turns_of_faces(std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<Turn> turns = {
      {{1, 0, 0}, M_PI}, {{0, 1, 0}, M_PI / 2}, {{0, 0, 1}, M_PI}, {{0, 0, 1}, M_PI / 2}, {{1, 0, 0}, M_PI}};
  for (Turn& t : turns) {
    t.axis = (t.axis + 0.02 * Vector3(normal(random), normal(random), normal(random))).normalized();
  }
  return turns;
}

// Poses of 6 s, turns of 2 s between them; SI, white noise of an industrial MEMS, and of a hand's tremor in the turns. `gyros`,
// `accelerometers`: the sensors' matrices.
PoseInput turned(const std::vector<Turn>& turns, std::mt19937& random, const Matrix3& gyros = Matrix3::Identity(),
                 const Matrix3& accelerometers = Matrix3::Identity()) {
  std::normal_distribution<double> normal;
  PoseInput input;
  input.accel_unit = 1.0;
  Vector3 u(0.0, 0.0, 1.0);
  const auto noise = [&](double sigma) {
    return Vector3(sigma * Vector3(normal(random), normal(random), normal(random)));
  };
  const auto sample = [&](const Vector3& rate, const Vector3& force) {
    u = matrix_from_rotation_vector(-rate * dt) * u;
    input.time_s.push_back((static_cast<double>(input.time_s.size()) + 1.0) * dt);
    const Vector3 w = gyros * rate + rate_bias + noise(7e-4),
                  f = accelerometers * (g * u + force) + force_bias + noise(5e-3);
    input.gyro.push_back({w.x(), w.y(), w.z()});
    input.accel.push_back({f.x(), f.y(), f.z()});
  };
  for (std::size_t k = 0; k <= turns.size(); ++k) {
    for (int i = 0; i < 600; ++i) {
      sample(Vector3::Zero(), Vector3::Zero());
    }
    for (int i = 0; k < turns.size() && i < 200; ++i) {
      const double rate = turns[k].angle / 2.0 * (1.0 - std::cos(2.0 * M_PI * (i + 0.5) / 200.0));
      sample(turns[k].axis * rate + noise(0.05), noise(0.3));
    }
  }
  return input;
}

std::vector<std::array<double, 3>> scaled(std::vector<std::array<double, 3>> values, double factor) {
  for (std::array<double, 3>& row : values) {
    for (double& value : row) {
      value *= factor;
    }
  }
  return values;
}

const PoseParameter& parameter(const std::vector<PoseParameter>& all, const std::string& name) {
  return *std::find_if(all.begin(), all.end(), [&](const PoseParameter& p) { return p.name == name; });
}

bool any_determined(const std::vector<PoseParameter>& all) {
  return std::any_of(all.begin(), all.end(), [](const PoseParameter& p) { return p.determined; });
}

TEST(PoseFaults, TurnsTellTheUnitOfCounts) {
  for (const double per_rad_s : {131.0 / units::degree, 1.0 / units::degree, 5e-3, 40.0 * 65536.0 / units::degree}) {
    std::mt19937 random(11);
    const Matrix3 gyros = Vector3(1.01, 0.985, 1.004).asDiagonal();
    PoseInput input = turned(turns_by_hand(16, random), random, gyros);
    input.gyro = scaled(input.gyro, per_rad_s);
    input.gyros_si = false;
    const PoseDiagnosis d = diagnose_poses(input, 0.01);
    ASSERT_TRUE(d.failure.empty()) << d.failure;
    ASSERT_GT(d.gyro_raw_unit, 0.0) << per_rad_s;
    EXPECT_TRUE(d.gyros_contradict.empty()) << d.gyros_contradict;
    for (int axis = 0; axis < 3; ++axis) {
      const PoseParameter& p = parameter(d.gyro_parameters, std::string("scale_") + "xyz"[axis]);
      ASSERT_TRUE(p.determined);
      EXPECT_EQ(p.unit, "raw/(rad/s)");
      EXPECT_NEAR(p.value, gyros(axis, axis) * per_rad_s, 5.0 * p.sigma);
      EXPECT_LT(p.sigma, 0.03 * per_rad_s);
    }
  }
}

TEST(PoseFaults, WrongAxesAreTold) {
  const Vector3 z_reversed(1.0, 1.0, -1.0), y_reversed(1.0, -1.0, 1.0);
  std::mt19937 random(12);
  const std::vector<Turn> turns = turns_by_hand(16, random);
  const PoseDiagnosis accelerometers =
      diagnose_poses(turned(turns, random, Matrix3::Identity(), z_reversed.asDiagonal()), 0.01);
  EXPECT_NE(accelerometers.gyros_contradict.find("the accelerometers as (x, y, -z)"), std::string::npos)
      << accelerometers.gyros_contradict;
  EXPECT_FALSE(any_determined(accelerometers.gyro_parameters));
  const PoseDiagnosis gyros = diagnose_poses(turned(turns, random, y_reversed.asDiagonal()), 0.01);
  EXPECT_NE(gyros.gyros_contradict.find("(x, -y, z)"), std::string::npos) << gyros.gyros_contradict;
  EXPECT_EQ(gyros.gyros_contradict.find("accelerometers"), std::string::npos) << gyros.gyros_contradict;
  const PoseDiagnosis sound = diagnose_poses(turned(turns, random), 0.01);
  EXPECT_TRUE(sound.gyros_contradict.empty()) << sound.gyros_contradict;
}

TEST(PoseFaults, IncrementsThatAreCalledRatesAreTold) {
  std::mt19937 random(13);
  PoseInput input = turned(turns_of_faces(random), random);
  input.gyro = scaled(input.gyro, dt);
  const PoseDiagnosis d = diagnose_poses(input, 0.01);
  EXPECT_NE(d.gyros_contradict.find("increments"), std::string::npos) << d.gyros_contradict;
  EXPECT_FALSE(any_determined(d.gyro_parameters));
}

// Five turns leave the nine elements one degree of freedom or two, and what they scatter by says little of their noise. Sixteen poses
// determine the accelerometers; the gyros are clipped in the other turns.
TEST(PoseFaults, FewTurnsDoNotUnderstateSigma) {
  int told = 0, beyond = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    PoseInput input = turned(turns_by_hand(16, random), random);
    for (std::size_t turn = 5; turn < 16; ++turn) {
      for (std::size_t k = 0; k < 20; ++k) {
        input.gyro[600 + 800 * turn + 90 + k][0] = 20.0;
      }
    }
    const PoseDiagnosis d = diagnose_poses(input, 0.01);
    ASSERT_EQ(d.turns, 5);
    for (const PoseParameter& p : d.gyro_parameters) {
      if (p.determined) {
        ++told;
        beyond += std::abs(p.value) > 5.0 * p.sigma ? 1 : 0;
      }
    }
  }
  // Student's distribution of one degree of freedom with 6.5 times its sigma is beyond five of them in 2 %, with its own in 13 %.
  EXPECT_GT(told, 100);
  EXPECT_LE(beyond, told / 25);
}

// Ten rounds about an axis that the scale factor errs by 1 % about are 36 deg.
TEST(PoseFaults, GravityIsNotCarriedThroughRounds) {
  std::mt19937 random(14);
  std::vector<Turn> turns = turns_by_hand(12, random);
  for (std::size_t k = 0; k < turns.size(); k += 2) {
    turns[k].angle += 20.0 * M_PI;
  }
  const Matrix3 gyros = Vector3(1.01, 0.99, 1.005).asDiagonal();
  const PoseDiagnosis d = diagnose_poses(turned(turns, random, gyros), 0.01);
  EXPECT_EQ(d.turns_whole, 6);
  EXPECT_EQ(d.turns, 6);
  for (const PoseParameter& p : d.gyro_parameters) {
    const int i = static_cast<int>(std::string("xyz").find(p.name[p.name.find('_') + 1]));
    const double truth = p.name.starts_with("scale_") ? gyros(i, i) - 1.0 : 0.0;
    EXPECT_TRUE(!p.determined || std::abs(p.value - truth) < 5.0 * p.sigma) << p.name << p.value << p.sigma;
  }
}

// A range of 1 g cuts faces off: their means are the range's end, whatever the bias.
TEST(PoseFaults, ClippedPosesTellNothing) {
  std::mt19937 random(15);
  const PoseInput sound = turned(turns_of_faces(random), random);
  PoseInput input = sound;
  for (std::array<double, 3>& row : input.accel) {
    for (double& value : row) {
      value = std::clamp(value, -g, 0.9999 * g);
    }
  }
  const PoseDiagnosis d = diagnose_poses(input, 0.01);
  EXPECT_GE(d.clipped_poses, 2);
  for (const PoseParameter& p : d.accel_parameters) {
    if (p.determined && p.name.starts_with("bias_")) {
      const auto axis = static_cast<Eigen::Index>(std::string("xyz").find(p.name.back()));
      EXPECT_LT(std::abs(p.value - force_bias(axis)), 5.0 * p.sigma) << p.name;
    }
  }
  EXPECT_EQ(diagnose_poses(sound, 0.01).clipped_poses, 0);
}

TEST(PoseFaults, AnAxisThatStopsAnsweringCostsWhatFollows) {
  std::mt19937 random(16);
  const PoseInput sound = turned(turns_by_hand(20, random), random);
  const std::size_t half = sound.time_s.size() / 2;
  for (const bool gyro : {true, false}) {
    PoseInput input = sound;
    std::vector<std::array<double, 3>>& series = gyro ? input.gyro : input.accel;
    for (std::size_t k = half; k < series.size(); ++k) {
      series[k][0] = series[half][0];
    }
    const PoseDiagnosis d = diagnose_poses(input, 0.01);
    ASSERT_TRUE(d.failure.empty()) << d.failure;
    ASSERT_EQ(d.left_out.size(), 1u);
    EXPECT_TRUE(d.gyro_named.empty());
    EXPECT_TRUE(d.accel_adequate);
    EXPECT_EQ(d.poses, 11);
    EXPECT_LT(d.direction_after, 2.0 * units::degree);
  }
  EXPECT_TRUE(diagnose_poses(sound, 0.01).left_out.empty());
}

// Bits that flip in counts of 16 bits, one word in two thousand: poses stay whole, and the turns are carried.
TEST(PoseFaults, BitsThatFlipAreTakenOut) {
  std::mt19937 random(20);
  const PoseInput sound = turned(turns_by_hand(18, random), random);
  PoseInput input = sound;
  std::uniform_real_distribution<double> uniform;
  std::size_t flipped = 0;
  for (auto* series : {&input.gyro, &input.accel}) {
    const double unit = series == &input.gyro ? units::degree / 16.4 : g / 8192.0;
    for (std::array<double, 3>& row : *series) {
      for (double& value : row) {
        if (uniform(random) < 5e-4) {
          const auto count = static_cast<std::int16_t>(std::lround(value / unit));
          const auto bit = static_cast<unsigned int>(11.0 + 4.0 * uniform(random));
          value = unit * static_cast<std::int16_t>(static_cast<std::uint16_t>(count) ^ (1U << bit));
          ++flipped;
        }
      }
    }
  }
  const PoseDiagnosis d = diagnose_poses(input, 0.01), whole = diagnose_poses(sound, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_GT(static_cast<double>(d.spikes), 0.7 * static_cast<double>(flipped));  // the others in turns, or at the ends
  EXPECT_LE(d.spikes, flipped);
  EXPECT_EQ(d.poses, whole.poses);
  EXPECT_LT(d.direction_after, 2.0 * whole.direction_after);
  EXPECT_TRUE(d.gyro_named.empty());
  EXPECT_EQ(whole.spikes, 0u);
}

// A knock between two poses: the bias is another from there on, and nothing drifts. Beside it what drifts is still named.
TEST(PoseFaults, AStepOfTheBiasIsNoDrift) {
  const Vector3 step(0.005, -0.0034, 0.0017);
  for (const double ramp : {0.0, 2e-5}) {
    std::mt19937 random(18);
    PoseInput input = turned(turns_by_hand(23, random), random);
    const double at = 12 * 8.0 - 1.0;  // in the twelfth turn
    for (std::size_t k = 0; k < input.gyro.size(); ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        input.gyro[k][axis] += ramp * input.time_s[k] * (axis == 0 ? 1.0 : 0.0);
        input.gyro[k][axis] += input.time_s[k] > at ? step(static_cast<Eigen::Index>(axis)) : 0.0;
      }
    }
    const PoseDiagnosis d = diagnose_poses(input, 0.01);
    ASSERT_TRUE(d.failure.empty()) << d.failure;
    ASSERT_EQ(d.gyro_jumps.size(), 1u) << ramp;
    EXPECT_FALSE(d.gyro_jumps[0].gap);
    EXPECT_NEAR(d.gyro_jumps[0].time_s, at + 1.0, 1.5);
    if (ramp == 0.0) {
      EXPECT_TRUE(d.gyro_named.empty());
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(d.gyro_jumps[0].size(axis), step(axis), 5.0 * d.gyro_jumps[0].sigma(axis));
      }
    } else {
      ASSERT_EQ(d.gyro_named.size(), 1u);
    }
  }
  // What drifts steadily is no step.
  std::mt19937 random(19);
  PoseInput input = turned(turns_by_hand(23, random), random);
  for (std::size_t k = 0; k < input.gyro.size(); ++k) {
    input.gyro[k][1] += 3e-5 * input.time_s[k];
  }
  const PoseDiagnosis d = diagnose_poses(input, 0.01);
  EXPECT_TRUE(d.gyro_jumps.empty());
  EXPECT_EQ(d.gyro_named.size(), 1u);
}

TEST(PoseFaults, ADeadAxisIsTold) {
  std::mt19937 random(17);
  const PoseInput sound = turned(turns_by_hand(16, random), random);
  PoseInput input = sound;
  for (std::array<double, 3>& row : input.gyro) {
    row[1] = 0.01;
  }
  const PoseDiagnosis d = diagnose_poses(input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_FALSE(d.gyro_axes[1]);
  EXPECT_TRUE(d.gyro_axes[0] && d.gyro_axes[2]);
  EXPECT_FALSE(any_determined(d.gyro_parameters));
  input = sound;
  for (std::array<double, 3>& row : input.accel) {
    row[2] = 0.02;
  }
  EXPECT_NE(diagnose_poses(input, 0.01).failure.find("accelerometer z"), std::string::npos);
}

}  // namespace
}  // namespace selfcal::diagnosis
