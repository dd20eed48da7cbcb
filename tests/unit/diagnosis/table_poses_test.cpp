// A sensor on a table made here: read-outs on a clock of their own, few poses, settling, knocks, clipping.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double dt = 0.01;
constexpr double g = 9.80665;

// Samples of a sensor in SI: white noise, bias, gain; the table's inner axis lies along y.
struct Table {
  PoseInput input;
  std::mt19937 random;
  std::normal_distribution<double> normal;
  Vector3 gyro_bias = Vector3(0.01, -0.1, 0.02), force_error = Vector3::Zero();
  double gain = 0.9, quadratic = 0.0, gyro_noise = 1e-3, force_noise = 0.02;
  double read_out_delay_s = 0.0, read_out_growth = 0.0;  // s, s/s
  std::vector<double> angle;                             // true, rad

  explicit Table(std::uint32_t seed) : random(seed) { input.accel_unit = 1.0; }
  double time() const { return dt * static_cast<double>(input.time_s.size()); }
  Vector3 noise(double sigma) { return sigma * Vector3(normal(random), normal(random), normal(random)); }
  void sample(const Vector3& rate, const Vector3& force, double inner) {
    input.time_s.push_back(time() + dt);
    const Vector3 gyro = rate + gyro_bias + noise(gyro_noise);
    const Vector3 accel = force + force_error + noise(force_noise);
    input.gyro.push_back({gyro.x(), gyro.y(), gyro.z()});
    input.accel.push_back({accel.x(), accel.y(), accel.z()});
    angle.push_back(inner);
  }
  void turn_about_y(double& at, double rate) {
    at += rate * dt;
    sample({0.0, gain * rate + quadratic * rate * std::abs(rate), 0.0}, g * Vector3(-std::sin(at), 0.0, std::cos(at)),
           at);
  }
  // What the read-out's clock makes of it.
  void write_read_outs() {
    for (std::size_t i = 0; i < angle.size(); ++i) {
      const double t = input.time_s[i] - read_out_delay_s - read_out_growth * input.time_s[i];
      const double k = std::clamp(t / dt - 1.0, 0.0, static_cast<double>(angle.size() - 1));
      const auto low = static_cast<std::size_t>(k);
      const std::size_t high = std::min(low + 1, angle.size() - 1);
      input.inner.push_back(angle[low] + (k - std::floor(k)) * (angle[high] - angle[low]));
    }
    input.outer.assign(angle.size(), 0.0);
  }
};

// 24 stops of 15 deg, 4 s each, between turns of 1 s.
Table stops() {
  Table t(1);
  t.read_out_delay_s = 0.3;
  t.read_out_growth = 2e-3;
  double at = 0.0;
  for (int stop = 0; stop < 24; ++stop) {
    for (int k = 0; k < 400; ++k) {
      t.turn_about_y(at, 0.0);
    }
    for (int k = 0; k < 100; ++k) {
      t.turn_about_y(at, 15.0 * units::degree * (1.0 - std::cos(2.0 * std::numbers::pi * (k + 0.5) / 100.0)));
    }
  }
  t.write_read_outs();
  return t;
}

TEST(TablePoses, GainAndClockFromStops) {
  const PoseDiagnosis d = diagnose_poses(stops().input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.read_outs && d.read_outs->axes.size() == 1 && d.read_outs->clock);
  const ReadOutAxis& axis = d.read_outs->axes.front();
  EXPECT_EQ(axis.name, "inner");
  // A turn's noise: 1e-3 rad/s sqrt(200 samples) dt = 1.4e-4 rad and as much by the biases of its stops, 23 of them in 6.0 rad:
  // 1.6e-4. Five times that.
  EXPECT_NEAR(axis.response.y(), 0.9, 8e-4);
  EXPECT_LT(axis.sigma.y(), 4e-4);
  EXPECT_NEAR(axis.response.x(), 0.0, 8e-4);
  // Middle of 120 s: 0.3 + 0.12 s. A turn's centre is known to 1e-3 rad/s sqrt(200) dt 0.6 s / 0.26 rad = 0.3 ms.
  EXPECT_NEAR(d.read_outs->clock->delay_s, 0.42, 2e-3);
  EXPECT_NEAR(d.read_outs->clock->growth_s, 0.24, 5e-3);
  EXPECT_TRUE(d.gyro_named.empty());
  EXPECT_FALSE(d.accel_tested);  // gravity moves in one plane
}

// The log's clock is 1 % fast, and the angles come from a file of commands with the right time: what the table does at t, which the
// log calls 1.01 t, stands at t. The gain is 0.9 * 1.01 by the log's time, in which a
// turn takes longer, and 0.9 where the commands' is right.
TEST(TablePoses, GainByTheLogsClockAndByTheReadOuts) {
  Table t = stops();
  t.input.inner.clear();
  t.input.outer.clear();
  for (double& time : t.input.time_s) {
    time *= 1.01;
  }
  for (std::size_t i = 0; i < t.angle.size(); ++i) {
    const double k = std::clamp(t.input.time_s[i] / dt - 1.0, 0.0, static_cast<double>(t.angle.size() - 1));
    t.input.inner.push_back(t.angle[static_cast<std::size_t>(std::lround(k))]);
  }
  t.input.outer.assign(t.angle.size(), 0.0);
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  ASSERT_TRUE(d.read_outs && d.read_outs->axes.size() == 1 && d.read_outs->clock);
  const ReadOutAxis& axis = d.read_outs->axes.front();
  EXPECT_NEAR(axis.response.y(), 0.9 * 1.01, 8e-4);
  EXPECT_NEAR(d.read_outs->clock->faster, 0.01, 5.0 * d.read_outs->clock->faster_sigma);
  EXPECT_LT(d.read_outs->clock->faster_sigma, 2e-4);
  EXPECT_NEAR(axis.response.y() / (1.0 + d.read_outs->clock->faster), 0.9, 1e-3);
}

// 36 turns of 10 deg, each 3 % off: white, or with a correlation of neighbours of 0.7.
Table uneven_turns(double alike) {
  Table t(4);
  double at = 0.0, off = 0.0;
  const auto rest = [&] {
    for (int k = 0; k < 400; ++k) {
      t.turn_about_y(at, 0.0);
    }
  };
  rest();
  for (int turn = 0; turn < 36; ++turn) {
    off = alike * off + std::sqrt(1.0 - alike * alike) * 0.03 * t.normal(t.random);
    t.gain = 0.9 * (1.0 + off);
    for (int k = 0; k < 100; ++k) {
      t.turn_about_y(at, 10.0 * units::degree);
    }
    rest();
  }
  t.write_read_outs();
  return t;
}

// A mean of 36 such turns is known to 0.5 % of 0.9 where they are white, and to sqrt((1 + 0.7) / (1 - 0.7)) = 2.4 times as much where they are not; by
// four lags of as few turns half of that and more is seen.
TEST(TablePoses, TurnsThatAreOffAlikeTellLess) {
  const PoseDiagnosis white = diagnose_poses(uneven_turns(0.0).input, 0.01),
                      alike = diagnose_poses(uneven_turns(0.7).input, 0.01);
  ASSERT_TRUE(white.read_outs && !white.read_outs->axes.empty() && alike.read_outs && !alike.read_outs->axes.empty());
  const ReadOutAxis &w = white.read_outs->axes.front(), &a = alike.read_outs->axes.front();
  EXPECT_EQ(w.turns_alike, 0.0);
  EXPECT_NEAR(w.turn_scatter, 0.027, 0.01);  // 12 % by 36 turns
  EXPECT_NEAR(w.sigma.y(), 0.0045, 0.0015);
  EXPECT_GT(a.turns_alike, 0.33);
  EXPECT_GT(a.sigma.y(), 1.4 * a.turn_scatter / 6.0);
}

// A gyro that is read at the end of its interval gives no mean over it: half an interval more, which the log does not show.
TEST(TablePoses, AClockIsKnownToHalfASample) {
  Table t = stops();
  for (std::size_t i = 0; i + 1 < t.input.gyro.size(); ++i) {
    t.input.gyro[i][1] = 0.5 * (t.input.gyro[i][1] + t.input.gyro[i + 1][1]);
  }
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  ASSERT_TRUE(d.read_outs && d.read_outs->clock) << d.failure;
  EXPECT_GE(d.read_outs->clock->delay_sigma_s, 0.5 * dt);
  EXPECT_NEAR(d.read_outs->clock->delay_s, 0.42, 2.0 * d.read_outs->clock->delay_sigma_s);
  EXPECT_GT(std::abs(d.read_outs->clock->delay_s - 0.42), 0.3 * dt);  // what the sigma is for
}

// Rates of 20 to 160 deg/s for 12 s each, a step of 1 s between them, 6 s at rest before and after.
Table rates(double quadratic) {
  Table t(2);
  t.quadratic = quadratic;
  t.read_out_delay_s = -0.2;
  double at = 0.0, rate = 0.0;
  const auto go = [&](double next, double seconds) {
    for (int k = 0; k < 100; ++k) {
      t.turn_about_y(at, rate + (next - rate) * (k + 0.5) / 100.0);
    }
    rate = next;
    for (int k = 0; k < static_cast<int>(seconds / dt); ++k) {
      t.turn_about_y(at, rate);
    }
  };
  go(0.0, 6.0);
  for (int step = 1; step <= 8; ++step) {
    go(20.0 * step * units::degree, 12.0);
  }
  go(0.0, 6.0);
  t.write_read_outs();
  return t;
}

TEST(TablePoses, BiasIsNoNonlinearity) {
  const PoseDiagnosis d = diagnose_poses(rates(0.0).input, 0.01);
  ASSERT_TRUE(d.read_outs && !d.read_outs->axes.empty() && d.read_outs->clock) << d.failure;
  const ReadOutAxis& axis = d.read_outs->axes.front();
  EXPECT_TRUE(axis.steady);
  EXPECT_EQ(axis.rows, 8);
  // Mean of 960 samples: 3e-5 rad/s, at rates that spread by 1 rad/s about their mean: 1e-5. Read-out rates: none. Ten times that.
  EXPECT_NEAR(axis.response.y(), 0.9, 1e-4);
  EXPECT_NEAR(d.read_outs->gyro_bias.y(), -0.1, 5e-4);
  ASSERT_TRUE(axis.nonlinearity);
  EXPECT_FALSE(axis.nonlinearity->determined);
  EXPECT_NEAR(d.read_outs->clock->delay_s, -0.2, 5e-3);
}

TEST(TablePoses, ANonlinearityIsNamed) {
  const PoseDiagnosis d = diagnose_poses(rates(0.002).input, 0.01);
  ASSERT_TRUE(d.read_outs && !d.read_outs->axes.empty()) << d.failure;
  ASSERT_TRUE(d.read_outs->axes.front().nonlinearity);
  EXPECT_TRUE(d.read_outs->axes.front().nonlinearity->determined);
}

// Six faces up and down, 60 s each, of accelerometers with noise of 5e-5 g; between them a hand turns for 4 s. `creep`: of the
// change of force along an axis, dying away with 10 s. `knocks`: somebody touches the bench every 7 s.
Table faces(double creep, bool knocks) {
  Table t(3);
  t.force_noise = 5e-5 * g;
  t.gyro_noise = 1e-5;
  const Matrix3 scale = Vector3(1.002, 0.997, 1.001).asDiagonal();
  const Vector3 bias(0.003 * g, -0.002 * g, 0.001 * g);
  Vector3 u(0.0, 0.0, 1.0), before = u;
  const std::array<Vector3, 5> turns = {Vector3(1, 0, 0), Vector3(1, 0, 0), Vector3(1, 0, 0), Vector3(0, 0, 1),
                                        Vector3(0, 0, 1)};
  const std::array<double, 5> quarters = {1.0, 1.0, 1.0, 1.0, 2.0};
  for (std::size_t pose = 0; pose < 6; ++pose) {
    for (int k = 0; k < 6000; ++k) {
      const double s = k * dt;
      t.force_error = pose == 0 ? Vector3(Vector3::Zero()) : Vector3(creep * g * (u - before) * std::exp(-s / 10.0));
      const double knock = knocks && std::fmod(s, 7.0) > 6.7 ? 0.05 * std::sin(300.0 * s) : 0.0;
      t.sample(Vector3(0.02 * knock, 0.0, 0.0), scale * u * g + bias + Vector3(0.0, 0.0, knock), 0.0);
    }
    t.force_error.setZero();
    before = u;
    for (int k = 0; pose < 5 && k < 400; ++k) {
      const double rate =
          quarters[pose] * std::numbers::pi / 8.0 * (1.0 - std::cos(2.0 * std::numbers::pi * (k + 0.5) / 400.0));
      u = matrix_from_rotation_vector(-turns[pose] * rate * dt) * u;
      t.sample(turns[pose] * rate, scale * u * g + bias, 0.0);
    }
  }
  return t;
}

const PoseParameter& parameter(const PoseDiagnosis& d, const std::string& name) {
  return *std::find_if(d.accel_parameters.begin(), d.accel_parameters.end(),
                       [&](const PoseParameter& p) { return p.name == name; });
}

TEST(TablePoses, SixPosesSayWhatTheyCan) {
  const PoseDiagnosis d = diagnose_poses(faces(0.0, true).input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 6);  // the knocks part none of them
  // Up and down fix bias and scale; six poses hold no misalignment that |f| shows to first order.
  EXPECT_TRUE(parameter(d, "bias_x").determined);
  EXPECT_TRUE(parameter(d, "scale_z").determined);
  EXPECT_FALSE(parameter(d, "misalignment_xy").determined);
  // Of a second order in a misalignment of 0.03 they are open: 4.5e-4, and within 5 sigma.
  EXPECT_NEAR(parameter(d, "scale_x").value, 0.002, std::max(1e-3, 5.0 * parameter(d, "scale_x").sigma));
  EXPECT_FALSE(d.accel_tested);
  EXPECT_FALSE(d.settling);
}

TEST(TablePoses, SettlingAfterTurnsIsNamed) {
  const PoseDiagnosis d = diagnose_poses(faces(2e-4, false).input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.settling);
  EXPECT_NEAR(d.settling->tau_s, 10.0, 5.1);  // the grid's neighbours are 5 and 20
}

// Three sizes of five amplitudes leave two degrees of freedom; sensors that are alike have one size, and four. A creep of 0.6 of what a sample
// scatters by; without it nothing is named (above).
TEST(TablePoses, AWeakSettlingOfSensorsThatAreAlikeIsNamed) {
  const PoseDiagnosis d = diagnose_poses(faces(3.2e-5, false).input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.settling);
  EXPECT_NEAR(d.settling->tau_s, 10.0, 5.1);
  EXPECT_NEAR(d.settling->size_g.x() / 3.2e-5, 1.0, 0.2);  // five amplitudes of 60 blocks of 100 samples: 4 %
}

TEST(TablePoses, ClippingIsNamed) {
  Table t = faces(0.0, false);
  for (std::array<double, 3>& rate : t.input.gyro) {
    for (double& value : rate) {
      value = std::clamp(value, -0.6, 0.6);  // turns peak at 0.79 and 1.57 rad/s
    }
  }
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  ASSERT_EQ(d.clipped.size(), 2u);
  EXPECT_TRUE(d.clipped[0].gyro && d.clipped[0].axis == 0 && d.clipped[1].axis == 2);
  EXPECT_NEAR(d.clipped[0].limit, 0.6, 1e-12);
  EXPECT_EQ(d.turns, 0);
  EXPECT_EQ(d.turns_clipped, 5);
  EXPECT_TRUE(diagnose_poses(faces(0.0, false).input, 0.01).clipped.empty());
}

// A logger that stood still for 5 s, and a row of zeros, cost themselves.
TEST(TablePoses, AFaultInPartCostsThatPart) {
  Table t = faces(0.0, false);
  for (std::size_t i = 1000; i < 1500; ++i) {
    t.input.accel[i] = t.input.accel[999];
    t.input.gyro[i] = t.input.gyro[999];
  }
  t.input.accel.back() = t.input.gyro.back() = {0.0, 0.0, 0.0};
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  EXPECT_EQ(d.poses, 6);
  ASSERT_EQ(d.left_out.size(), 2u);
  EXPECT_EQ(d.left_out[0].samples, 1u);  // zeros first
  EXPECT_EQ(d.left_out[1].samples, 500u);
  EXPECT_NEAR(d.static_seconds, 360.0, 20.0);
  EXPECT_LT(d.static_seconds, 355.5);
}

// Poses that are turned on and on about one axis: their direction and the time go together.
TEST(TablePoses, OrderOfPosesAndTimeIsConfounded) {
  Table t(4);
  double at = 0.0;
  for (int pose = 0; pose < 18; ++pose) {
    for (int k = 0; k < 400; ++k) {
      t.gyro_bias.x() = 2e-3 * std::cos(at);  // a g-sensitivity
      t.turn_about_y(at, 0.0);
    }
    for (int k = 0; k < 100; ++k) {
      t.turn_about_y(at, 9.0 * units::degree * (1.0 - std::cos(2.0 * std::numbers::pi * (k + 0.5) / 100.0)));
    }
  }
  const PoseDiagnosis d = diagnose_poses(t.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  const auto with_force = [](const Confounded& c) { return c.with->id == "gyro_g_sensitivity" && c.shared > 0.9; };
  EXPECT_TRUE(std::any_of(d.confounded.begin(), d.confounded.end(), with_force));
  ASSERT_FALSE(d.gyro_named.empty());
}

}  // namespace
}  // namespace selfcal::diagnosis
