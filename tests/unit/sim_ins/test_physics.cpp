// Concealed physics: each effect changes the output as its equation says, every effect changes something, and files
// name what is wrong with them.
#include <gmock/gmock.h>

#include <cmath>

#include "estimator/geometry/units.hpp"
#include "sim_ins/sensor_physics.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

using testing::HasSubstr;

SensorDeviation deviation_of(const std::string& toml, const SensorContext& context) {
  const auto physics = parse_physics(toml, "physics.toml");
  EXPECT_TRUE(physics) << physics.error().message;
  SensorDeviation deviation;
  for (const PhysicsEffect& effect : physics->effects) {
    sensor_equation(effect.id)(effect.values, context, deviation);
  }
  return deviation;
}

SensorContext at_one_g_along_y() {
  SensorContext context;
  static constexpr TemperatureConfig warm_up;
  context.temperature = &warm_up;
  context.f_ib_b = Vector3(0.0, units::standard_gravity, 0.0);
  context.omega_ib_b = Vector3(0.0, 0.0, -0.2);
  return context;
}

constexpr double exact = 1e-18;  // rounding of the numbers below, all smaller than 1e-2

TEST(Physics, LiteralCases) {
  SensorContext context = at_one_g_along_y();
  const double ug = units::micro_g;
  const double dph = units::degree_per_hour;
  EXPECT_NEAR(deviation_of("[[effect]]\nid='gyro_g_sensitivity'\nxy=0.01\nxz=5\n", context).domega.x(), 0.01 * dph,
              exact);
  EXPECT_NEAR(deviation_of("[[effect]]\nid='gyro_scale_asymmetry'\nz=10\n", context).domega.z(), 2e-6, exact);
  // c w |w|: -0.2 rad/s = -11.459 deg/s, 1 ppm/(deg/s): 11.459e-6 * -0.2.
  EXPECT_NEAR(deviation_of("[[effect]]\nid='gyro_scale_nonlinearity'\nz=1\n", context).domega.z(),
              -0.2e-6 * 0.2 * 57.29577951308232, 1e-17);
  EXPECT_NEAR(deviation_of("[[effect]]\nid='accel_quadratic'\ny=20\n", context).df.y(), 20 * ug, exact);
  context.f_ib_b = -context.f_ib_b;
  EXPECT_NEAR(deviation_of("[[effect]]\nid='accel_quadratic'\ny=20\n", context).df.y(), 20 * ug, exact);
  EXPECT_NEAR(deviation_of("[[effect]]\nid='accel_cubic'\ny=20\n", context).df.y(), -20 * ug, exact);
  EXPECT_NEAR(deviation_of("[[effect]]\nid='accel_cross_squares'\nx_yy=20\n", context).df.x(), 20 * ug, exact);
  EXPECT_NEAR(deviation_of("[[effect]]\nid='accel_cross_squares'\nz_yy=20\nz_xx=5\n", context).df.z(), 20 * ug, exact);
  context.t = 3600.0;
  EXPECT_NEAR(deviation_of("[[effect]]\nid='accel_bias_ramp'\nx=20\n", context).df.x(), 20 * ug, exact);
  context.since_turn_s = 60.0;
  EXPECT_NEAR(deviation_of("[[effect]]\nid='accel_relaxation'\nx=50\ntau_s=60\n", context).df.x(),
              50 * ug * 0.36787944117144233, exact);
  context.since_turn_s = -1.0;  // no turn yet
  EXPECT_EQ(deviation_of("[[effect]]\nid='accel_relaxation'\nx=50\n", context).df.x(), 0.0);
}

TEST(Physics, LeverArmIsCentripetalAndTangential) {
  SensorContext context = at_one_g_along_y();
  context.angular_acceleration = Vector3(0.0, 0.0, 0.3);
  const Vector3 df = deviation_of("[[effect]]\nid='imu_lever_arm'\nx=2\n", context).df;  // 2 cm along x
  EXPECT_NEAR(df.x(), -0.2 * 0.2 * 0.02, exact);                                         // towards the axis
  EXPECT_NEAR(df.y(), 0.3 * 0.02, exact);
}

TEST(Physics, FlexureTurnsTheTriadUnderLoad) {
  // K_zy u_y = 1 arcsec about z; (0,0,k) x (0,g,0) = (-k g, 0, 0).
  const Vector3 df = deviation_of("[[effect]]\nid='triad_flexure'\nzy=1\n", at_one_g_along_y()).df;
  EXPECT_NEAR(df.x(), -units::arcsecond * units::standard_gravity, exact);
}

// Lagged rate: against Euler steps of a tenth of a second, whose error over tau = 300 s is of order 0.1/300.
TEST(Physics, LaggedGradientFollowsItsDifferentialEquation) {
  const TemperatureConfig config;
  double y = 0.0;
  constexpr double h = 0.1;
  for (int k = 0; k < 6000; ++k) {
    const double rate = (temperature_at(config, (k + 1) * h) - temperature_at(config, k * h)) / h;
    y += h * (rate - y) / 300.0;
  }
  EXPECT_NEAR(lagged_temperature_rate(config, 600.0, 300.0) / y, 1.0, 1e-3);
}

// Every effect of the table, alone, at a large value of its first parameters: the recording must not be the clean one.
TEST(Physics, EveryEffectActs) {
  const Schedule schedule = *named_schedule("horizontal", 10.0);
  SimConfig config;
  config.sample_rate_hz = 50.0;
  const auto clean = simulate(config, schedule, 5, {});
  ASSERT_TRUE(clean);
  for (const EffectDescription& effect : physics_effects()) {
    PhysicsEffect active{std::string(effect.id), {}};
    for (const EffectParameter& parameter : effect.parameters) {
      // What has a default is a time or a place; the rest is a size.
      const double value = parameter.default_value != 0.0 ? parameter.default_value : 100.0;
      active.values.push_back(value * parameter.si_per_unit);
    }
    if (effect.id == "lost_samples") {
      active.values = {30.0, 3.0, 0.0, 0.0};
    }
    const auto spoilt = simulate(config, schedule, 5, {{active}});
    ASSERT_TRUE(spoilt) << effect.id << ": " << spoilt.error().message;
    EXPECT_TRUE(spoilt->delta_theta_rad != clean->delta_theta_rad || spoilt->delta_v_mps != clean->delta_v_mps)
        << effect.id;
  }
}

// Noise of the integral: increments differ by n_k - n_(k-1). Their variance is 2 sigma^2, neighbours share -sigma^2, and the sum stays
// bounded. 10,000 samples: the variance scatters by 1.7 %.
TEST(Physics, NoiseOfTheIntegralIsWhite) {
  SimConfig config;
  config.sample_rate_hz = 50.0;
  const Schedule still{{{0.0, 0.0}}, {200.0}, 5.0};
  const auto clean = simulate(config, still, 5, {});
  const auto noisy = simulate(config, still, 5, *parse_physics("[[effect]]\nid='integral_noise'\naccel_y=0.01\n", "p"));
  ASSERT_TRUE(clean && noisy);
  double variance = 0.0, neighbours = 0.0, sum = 0.0, before = 0.0;
  const std::size_t n = clean->delta_v_mps.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double d = noisy->delta_v_mps[i][1] - clean->delta_v_mps[i][1];
    variance += d * d / static_cast<double>(n);
    neighbours += d * before / static_cast<double>(n);
    before = d;
    sum += d;
    EXPECT_NEAR(noisy->delta_v_mps[i][0], clean->delta_v_mps[i][0], 1e-9);
  }
  EXPECT_NEAR(variance / (2.0 * 1e-4), 1.0, 0.07);
  EXPECT_NEAR(neighbours / 1e-4, -1.0, 0.1);
  EXPECT_LT(std::abs(sum), 6.0 * 0.01);
}

TEST(Physics, FilesNameWhatIsWrong) {
  const auto message = [](const char* text) {
    const auto read = parse_physics(text, "p.toml");
    return read ? std::string("accepted") : read.error().message;
  };
  EXPECT_THAT(message("[[effect]]\nid = 'gremlins'\n"),
              HasSubstr("p.toml:2: effect[0].id: no effect is called gremlins"));
  EXPECT_THAT(message("[[effect]]\nid = 'accel_cubic'\nw = 1\n"), HasSubstr("p.toml:3: effect[0].w: no such key"));
  EXPECT_THAT(message("[[effect]]\nid = 'accel_relaxation'\ntau_s = 0\n"), HasSubstr("p.toml:3: effect[0].tau_s"));
  EXPECT_THAT(message("[[effect]]\nx = 1\n"), HasSubstr("effect[0].id: missing"));
  EXPECT_THAT(message("effect = 3\n"), HasSubstr("p.toml:1: effect"));
  // These two toml++ by itself does not survive.
  EXPECT_THAT(message("[[effect]]\nw = 6='\u00C5\n"), HasSubstr("p.toml:2: "));
  EXPECT_THAT(message("[a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a]\n"), HasSubstr("p.toml:1: a key of more than"));
  EXPECT_THAT(message("[[effect]]\nid = 'accel_cubic'\n\"w\\nw\" = 1\n"),
              HasSubstr("p.toml:3: effect[0].w w: no such key"));
}

}  // namespace
}  // namespace selfcal::sim
