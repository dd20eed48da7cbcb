// The true motion against values worked out by hand, and against itself: what a perfect IMU measures must navigate to
// where the base is.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "estimator/geometry/units.hpp"
#include "sim_ins/imu_simulator.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

constexpr double latitude = 40.0 * units::degree;
// Numbers from outside the code: 7.292115e-5 rad/s times cos and sin of 40 deg; gravity at 40 deg and 0 m as
// (a gamma_e cos^2 + b gamma_p sin^2) / sqrt(a^2 cos^2 + b^2 sin^2) with the WGS-84 gravities of equator and pole.
constexpr double omega_north = 5.586084180e-5;
constexpr double omega_up = 4.687281110e-5;
constexpr double gravity = 9.801696863;

TrueMotion resting(double heading_deg, double pitch_deg, double outer_deg, double inner_deg) {
  const Attitude attitude{0.0, pitch_deg * units::degree, heading_deg * units::degree};
  return {{latitude, 0.0, 0.0}, attitude, {}, GimbalMotion({outer_deg * units::degree, inner_deg * units::degree}, {})};
}

void expect_near(const Vector3& value, const Vector3& wanted, double tolerance) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(value[i], wanted[i], tolerance) << "component " << i;
  }
}

// Tolerances: the literals have ten digits of a rate (5e-14 rad/s) and ten of gravity; the rounded constants behind the
// two forms of Somigliana agree to 1e-9 m/s^2.
void expect_state(const TrueMotion& motion, const Vector3& omega, const Vector3& f) {
  expect_near(motion.at(0.0).omega_ib_b, omega, 1e-12);
  expect_near(motion.at(0.0).f_ib_b, f, 5e-9);
}

TEST(TrueMotion, LevelFacingNorthGimbalAtZero) {
  expect_state(resting(0, 0, 0, 0), {omega_north, omega_up, 0}, {0, gravity, 0});
}

TEST(TrueMotion, HeadingIsClockwise) {  // facing east: north is to the left, and z points right
  expect_state(resting(90, 0, 0, 0), {0, omega_up, -omega_north}, {0, gravity, 0});
}

TEST(TrueMotion, OuterTurnsAboutZ) {  // right-handed about z (right): x goes up, so x takes gravity
  expect_state(resting(0, 0, 90, 0), {omega_up, -omega_north, 0}, {gravity, 0, 0});
}

TEST(TrueMotion, InnerTurnsAboutY) {  // right-handed about y (up): z turns to where x was
  expect_state(resting(0, 0, 0, 90), {0, omega_up, omega_north}, {0, gravity, 0});
}

TEST(TrueMotion, NoseUpIsPositivePitch) {
  expect_state(resting(0, 90, 0, 0), {omega_up, -omega_north, 0}, {gravity, 0, 0});
}

TEST(TrueMotion, GimbalRateAddsAboutItsAxis) {
  const GimbalMove move{0.0, 5.0, 1.5, {0.0, 0.0}, {90.0 * units::degree, 0.0}};
  const TrueMotion motion({latitude, 0, 0}, {}, {}, GimbalMotion({0, 0}, {move}));
  // At mid-move the rate is the peak, 90 deg / (5 - 1.5) s, about the outer axis, which is b's z while inner is 0.
  EXPECT_NEAR(motion.at(2.5).omega_ib_b.z(), 90.0 * units::degree / 3.5, 1e-12);
  EXPECT_NEAR(motion.gimbal().at(2.5).angle[0], 45.0 * units::degree, 1e-12);
  EXPECT_NEAR(motion.gimbal().at(5.0).angle[0], 90.0 * units::degree, 1e-12);
}

// A navigation of its own: attitude by exact rotation vectors of each interval, velocity by the increment at
// mid-interval attitude, coning and sculling corrected to second order from neighbouring increments. It sums in long
// double: in double the same rounding of 1e-16 in every step adds up to 7e-11 rad, half a millimetre, in an hour.
struct Navigator {
  using Real = long double;
  using Wide = Eigen::Matrix<Real, 3, 1>;
  Eigen::Quaternion<Real> q;
  Wide v = Wide::Zero();
  Wide p = Wide::Zero();
  Vector3 theta_before = Vector3::Zero();
  Vector3 dv_before = Vector3::Zero();

  explicit Navigator(const Matrix3& C_nb) : q(Eigen::Quaterniond(C_nb).cast<Real>()) { q.normalize(); }

  void step(const Vector3& theta, const Vector3& dv, double h) {
    const Vector3 p_now = p.cast<double>();
    const Vector3 v_now = v.cast<double>();
    const earth::Position here{latitude + p_now.x() / earth::meridian_radius(latitude), 0.0, p_now.y()};
    const Vector3 ie = earth::omega_ie_n(here.latitude);
    const Vector3 en = earth::omega_en_n(here, v_now);
    const Vector3 coning = theta_before.cross(theta) / 12.0;
    const Vector3 dv_b = dv + 0.5 * theta.cross(dv) + (theta_before.cross(dv) + dv_before.cross(theta)) / 12.0;
    const Vector3 g(0.0, -earth::normal_gravity(here.latitude, here.height), 0.0);
    const auto turned = [](const Vector3& phi) { return quaternion_from_rotation_vector(phi).cast<Real>(); };
    const Wide dv_n = turned(-0.5 * h * (ie + en)) * (q * dv_b.cast<Real>().eval());
    const Wide v_old = v;
    v += dv_n + Real{h} * (g - (2.0 * ie + en).cross(v_now)).cast<Real>();
    p += Real{0.5} * Real{h} * (v_old + v);
    q = turned(-h * (ie + en)) * q * turned(theta + coning);
    q.normalize();
    theta_before = theta;
    dv_before = dv;
  }
};

SimConfig perfect() {
  SimConfig config;
  config.parameter_set = "none";
  config.height_m = 0.0;
  config.gyro_arw_deg_per_sqrt_h = 0.0;
  config.accel_vrw_ug_per_sqrt_hz = 0.0;
  return config;
}

Vector3 drift_of(const SimConfig& config, const GimbalMotion& gimbal, double seconds) {
  auto imu = ImuSimulator::create(config, gimbal, 1, {});
  EXPECT_TRUE(imu) << imu.error().message;
  Navigator navigator(imu->motion().at(0.0).C_nb);
  const double h = 1.0 / config.sample_rate_hz;
  for (int k = 0; k < static_cast<int>(seconds * config.sample_rate_hz); ++k) {
    const IdealIncrement increment = imu->integrate(k * h, (k + 1) * h);
    navigator.step(increment.delta_theta, increment.delta_v, h);
  }
  return navigator.p.cast<double>();
}

// What is left is the rounding of the truth itself: 1e-16 of the starting attitude (1e-9 m), and 1e-16 of gravity,
// which is 1e-15 m/s^2 (t^2/2: 1e-8 m) times exp(t sqrt(2g/R)) = 700 in the vertical: micrometres.
TEST(TrueMotion, StillBaseStaysStillForAnHour) {
  const Vector3 p = drift_of(perfect(), GimbalMotion({0.3, 1.2}, {}), 3600.0);
  EXPECT_LT(std::hypot(p.x(), p.z()), 5e-6);
  EXPECT_LT(std::abs(p.y()), 20e-6);
}

// The negative control: 0.001 deg/h about the vertical's horizontal axes is 1e-6 rad in an hour and moves it metres.
TEST(TrueMotion, TheNavigatorSeesAThousandthOfADegreePerHour) {
  SimConfig config = perfect();
  config.explicit_parameters[parameter::gyro_drift] = 0.001;
  const Vector3 p = drift_of(config, GimbalMotion({0.0, 0.0}, {}), 3600.0);
  EXPECT_GT(std::hypot(p.x(), p.z()), 10.0);
}

// Turning, the navigator's own second-order corrections leave g (0.6 rad/s)^3 h^3 / 60 = 3e-9 m/s a sample while the
// rate changes; over the 18 moves of 49 min that is below a millimetre a second for some seconds: 5 cm in all.
TEST(TrueMotion, WholeScheduleStaysStill) {
  SimConfig config = perfect();
  config.sample_rate_hz = 400.0;
  Random random(1, 2);
  const Schedule schedule = *named_schedule("horizontal", 20.0);
  const Vector3 p = drift_of(config, plan_gimbal(config.gimbal, schedule, random), schedule.duration_s());
  EXPECT_LT(p.norm(), 0.05);
}

}  // namespace
}  // namespace selfcal::sim
