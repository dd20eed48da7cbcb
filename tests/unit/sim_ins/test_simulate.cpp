// simulate(): signs of the 24 errors by literal cases, noise by its statistics, the same bits from the same seed.
#include <gmock/gmock.h>

#include <cmath>

#include "estimator/geometry/units.hpp"
#include "sim_ins/imu_simulator.hpp"
#include "sim_ins/sensor_errors.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

using testing::HasSubstr;

SensorErrors one(int index, double value) {
  SensorErrors errors{};
  errors[static_cast<std::size_t>(index)] = value;
  return errors;
}

// tools/handbook/frames-and-signs.md, number by number.
TEST(SensorErrors, SignsAreTheMissions) {
  const Vector3 f(2.0, -3.0, 5.0);
  using V = Vector3;
  EXPECT_EQ(accel_error(one(parameter::accel_bias + 1, 7.0), f), V(0, 7, 0));
  EXPECT_EQ(accel_error(one(parameter::accel_scale_pos, 0.5), f), V(1, 0, 0));
  EXPECT_EQ(accel_error(one(parameter::accel_scale_pos + 1, 0.5), f), V(0, 0, 0));        // f_y < 0: K+ does nothing
  EXPECT_EQ(accel_error(one(parameter::accel_scale_neg + 1, 0.5), f), V(0, 1.5, 0));      // K- multiplies |f|
  EXPECT_EQ(accel_error(one(parameter::accel_misalignment, 0.5), f), V(0, 1, 0));         // yx
  EXPECT_EQ(accel_error(one(parameter::accel_misalignment + 1, 0.5), f), V(0, 0, 1));     // zx
  EXPECT_EQ(accel_error(one(parameter::accel_misalignment + 2, 0.5), f), V(0, 0, -1.5));  // zy
  const V w(2.0, -3.0, 5.0);
  EXPECT_EQ(gyro_error(one(parameter::gyro_drift + 2, 7.0), w), V(0, 0, 7));
  EXPECT_EQ(gyro_error(one(parameter::gyro_scale + 1, 0.5), w), V(0, -1.5, 0));
  const int G = parameter::gyro_misalignment;
  EXPECT_EQ(gyro_error(one(G + 0, 0.5), w), V(-1.5, 0, 0));  // xy
  EXPECT_EQ(gyro_error(one(G + 1, 0.5), w), V(2.5, 0, 0));   // xz
  EXPECT_EQ(gyro_error(one(G + 2, 0.5), w), V(0, 1, 0));     // yx
  EXPECT_EQ(gyro_error(one(G + 3, 0.5), w), V(0, 2.5, 0));   // yz
  EXPECT_EQ(gyro_error(one(G + 4, 0.5), w), V(0, 0, 1));     // zx
  EXPECT_EQ(gyro_error(one(G + 5, 0.5), w), V(0, 0, -1.5));  // zy
}

Schedule short_schedule() { return *named_schedule("horizontal", 2.0); }

TEST(Simulate, SameSeedSameBitsAndAnotherSeedOthers) {
  const SimConfig config;
  const auto a = simulate(config, short_schedule(), 7, {});
  const auto b = simulate(config, short_schedule(), 7, {});
  const auto c = simulate(config, short_schedule(), 8, {});
  ASSERT_TRUE(a && b && c);
  EXPECT_EQ(a->size(), 200U * (19 * 2 + 18 * 5));
  EXPECT_EQ(a->delta_theta_rad, b->delta_theta_rad);
  EXPECT_EQ(a->delta_v_mps, b->delta_v_mps);
  EXPECT_EQ(a->temperature_c, b->temperature_c);
  EXPECT_NE(a->delta_v_mps, c->delta_v_mps);
}

// Sums over n samples at rest: a random walk of ARW sqrt(T). 300 sums of 2 s estimate sigma to 1/sqrt(600) = 4 %; a
// tenth of an arcsecond of quantum adds nothing to sums this long. Twice the noise must fail the same bounds.
double scatter_of_sums(double arw, int axis) {
  SimConfig config;
  config.parameter_set = "none";
  config.gyro_arw_deg_per_sqrt_h = arw;
  auto imu = ImuSimulator::create(config, GimbalMotion{}, 3, {});
  EXPECT_TRUE(imu);
  const double expected = imu->motion().at(0.0).omega_ib_b[axis] * 2.0;
  double squares = 0.0;
  constexpr int sums = 300;
  for (int k = 0; k < sums; ++k) {
    double sum = 0.0;
    for (int i = 0; i < 400; ++i) {
      sum += imu->next().delta_theta[static_cast<std::size_t>(axis)] * 0.1 * units::arcsecond;
    }
    squares += (sum - expected) * (sum - expected);
  }
  return std::sqrt(squares / sums);
}

TEST(Simulate, AngleRandomWalkIsAsAskedFor) {
  const double wanted = 0.01 * units::degree_per_sqrt_hour * std::sqrt(2.0);
  EXPECT_NEAR(scatter_of_sums(0.01, 0) / wanted, 1.0, 0.16);  // 4 sigma
  EXPECT_NEAR(scatter_of_sums(0.01, 2) / wanted, 1.0, 0.16);
  EXPECT_GT(scatter_of_sums(0.02, 0) / wanted, 1.5);
}

// Quantisation carries its remainder: sums are never further from the truth than one count.
TEST(Simulate, QuantisationLosesNothing) {
  SimConfig config;
  config.gyro_arw_deg_per_sqrt_h = 0.0;
  config.accel_vrw_ug_per_sqrt_hz = 0.0;
  auto imu = ImuSimulator::create(config, GimbalMotion{}, 3, {});
  ASSERT_TRUE(imu);
  const IdealIncrement whole = imu->integrate(0.0, 100.0);
  std::array<double, 3> theta{}, velocity{};
  for (int k = 0; k < 20000; ++k) {
    const ImuSample sample = imu->next();
    for (std::size_t i = 0; i < 3; ++i) {
      theta[i] += sample.delta_theta[i] * config.gyro_lsb_arcsec * units::arcsecond;
      velocity[i] += sample.delta_v[i] * config.accel_lsb_m_per_s;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const int axis = static_cast<int>(i);
    EXPECT_NEAR(theta[i], whole.delta_theta[axis], 0.51 * config.gyro_lsb_arcsec * units::arcsecond);
    EXPECT_NEAR(velocity[i], whole.delta_v[axis], 0.51 * config.accel_lsb_m_per_s);
  }
}

// Gimbal corners and the kink of max(f, 0): one sample interval against a thousand parts of it.
TEST(Simulate, IntegralsOfOneSampleAreExact) {
  SimConfig config;
  config.sample_rate_hz = 50.0;
  config.base_motion = moored_base_motion();
  Random random(1, 2);
  const auto gimbal = plan_gimbal(config.gimbal, short_schedule(), random);
  auto imu = ImuSimulator::create(config, gimbal, 3, {});
  ASSERT_TRUE(imu);
  for (int k = 95; k < 360; ++k) {
    const double begin = k * 0.02 + 0.0013;  // off the profile's corners
    const IdealIncrement at_once = imu->integrate(begin, begin + 0.02);
    IdealIncrement parts;
    for (int i = 0; i < 1000; ++i) {
      const IdealIncrement part = imu->integrate(begin + i * 2e-5, begin + (i + 1) * 2e-5);
      parts.delta_theta += part.delta_theta;
      parts.delta_v += part.delta_v;
    }
    // A thousandth of one sample's noise: 1e-3 ARW sqrt(h), 1e-3 VRW sqrt(h).
    EXPECT_LT((at_once.delta_theta - parts.delta_theta).norm(), 1e-3 * 2.9e-7 * std::sqrt(0.02)) << k;
    EXPECT_LT((at_once.delta_v - parts.delta_v).norm(), 1e-3 * 4.9e-5 * std::sqrt(0.02)) << k;
  }
}

TEST(Simulate, RefusesWhatTheGimbalCannotDo) {
  Schedule schedule = short_schedule();
  schedule.rotation_s = 2.0;  // 90 deg in 2 s
  const auto refused = simulate({}, schedule, 1, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(refused.error().message, HasSubstr("move 1"));
}

TEST(SimConfigFile, ReadsValuesAndNamesWhatIsWrong) {
  const auto good = parse_sim_config(
      "sample_rate_hz = 100\n[site]\nlatitude_deg = -33\n[base_motion]\npreset = 'moored'\n"
      "[parameters]\ngyro_scale_y = 12.5\n",
      "sim.toml");
  ASSERT_TRUE(good) << good.error().message;
  EXPECT_EQ(good->sample_rate_hz, 100.0);
  EXPECT_EQ(good->latitude_deg, -33.0);
  EXPECT_EQ(good->base_motion.yaw.size(), 2U);
  EXPECT_DOUBLE_EQ(true_sensor_errors(*good, 1)->at(parameter::gyro_scale + 1), 12.5e-6);

  const auto message = [](const char* text) {
    const auto read = parse_sim_config(text, "sim.toml");
    return read ? std::string("accepted") : read.error().message;
  };
  EXPECT_THAT(message("\nsample_rate = 100\n"), HasSubstr("sim.toml:2: sample_rate: no such key"));
  EXPECT_THAT(message("sample_rate_hz = 10\n"), HasSubstr("sim.toml:1: sample_rate_hz: 10 is outside [50, 1000]"));
  EXPECT_THAT(message("[site]\nlatitude_deg = 'x'\n"), HasSubstr("sim.toml:2: site.latitude_deg: not a number"));
  EXPECT_THAT(message("[noise]\ngyro_arw_deg_per_sqrt_h = nan\n"), HasSubstr("sim.toml:2"));
  EXPECT_THAT(message("a = \n"), HasSubstr("sim.toml:1"));
}

}  // namespace
}  // namespace selfcal::sim
