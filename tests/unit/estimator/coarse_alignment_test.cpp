// Coarse alignment at any attitude and latitude, on a still and on a roughly moored base, with three times the errors
// of the source's Table 5, against bounds derived from those errors.
//
// In b0 the specific force turns as df/dt = w_ie x f. Errors df, dw of the sensors add C dw x f + w_ie x df: up is off
// by |df|/g, east by (|dw| + Omega |df|/g)/(Omega cos L) about the vertical. Added to that: noise, and what the window
// passes of the base's motion, whose velocity is fitted along with the drift (response below).
//
// Required: the filter's prior is 0.2 rad, and phi^2/2 must stay a small part of phi: up to 0.2 rad the errors are
// linear to a tenth. The bounds of all cases are below it.
#include <gtest/gtest.h>

#include <complex>
#include <numbers>
#include <vector>

#include "estimator/geometry/units.hpp"
#include "estimator/navigation/coarse_alignment.hpp"
#include "sim_ins/imu_simulator.hpp"
#include "sim_ins/sensor_errors.hpp"
#include "tests/unit/estimator/simulated.hpp"

namespace selfcal {
namespace {

constexpr double span_s = 150.0;

struct Case {
  Attitude attitude_deg;
  double latitude_deg;
  bool moored;

  friend std::ostream& operator<<(std::ostream& out, const Case& c) {
    return out << "roll " << c.attitude_deg.roll << " pitch " << c.attitude_deg.pitch << " heading "
               << c.attitude_deg.heading << " latitude " << c.latitude_deg << (c.moored ? " moored" : " still");
  }
};

// What the fit of v0 + a t + b t^2/2 under sin^2 makes of a velocity exp(i w t): |a| (1/s) and |b| (1/s^2).
std::pair<double, double> response(double w) {
  Matrix3 normal = Matrix3::Zero();
  Eigen::Vector3cd right = Eigen::Vector3cd::Zero();
  for (double t = 0.0; t < span_s; t += 0.1) {
    const double weight = std::pow(std::sin(std::numbers::pi * t / span_s), 2);
    const Vector3 basis(1.0, t, 0.5 * t * t);
    normal += weight * basis * basis.transpose();
    right += weight * basis * std::exp(std::complex<double>(0.0, w * t));
  }
  const Eigen::Vector3cd fit = normal.inverse().cast<std::complex<double>>() * right;
  return {std::abs(fit(1)), std::abs(fit(2))};
}

struct Bound {
  double level, heading;  // rad
};

Bound bound_for(const sim::SimConfig& config, const sim::MotionState& start) {
  const sim::SensorErrors errors = *sim::true_sensor_errors(config, 1);
  const double g = 9.8;
  const double horizontal = earth::rotation_rate * std::cos(config.latitude_deg * units::degree);
  double df = sim::accel_error(errors, start.f_ib_b).norm();
  const Vector3 rate = start.C_nb.transpose() * earth::omega_ie_n(config.latitude_deg * units::degree);
  double dw = sim::gyro_error(errors, rate).norm();
  // Noise: 4 sigma of the mean rate over the span, the window doubling its variance; the quantum once over the span.
  dw += 4.0 * 1.4 * config.gyro_arw_deg_per_sqrt_h * units::degree_per_sqrt_hour / std::sqrt(span_s) +
        config.gyro_lsb_arcsec * units::arcsecond / span_s;
  // White specific force: the slope of an acceleration, sqrt(12/T^3), again with the window.
  const double slope_of_noise = std::sqrt(12.0 / std::pow(span_s, 3));
  double turning = 4.0 * 1.4 * config.accel_vrw_ug_per_sqrt_hz * units::micro_g * slope_of_noise;
  for (const auto* axis : {&config.base_motion.surge, &config.base_motion.heave, &config.base_motion.sway}) {
    for (const sim::Sine& sine : *axis) {
      const double w = 2.0 * std::numbers::pi / sine.period_s;
      const auto [force, slope] = response(w);
      df += force * w * sine.amplitude;
      turning += slope * w * sine.amplitude;
    }
  }
  const double level = df / g;
  // Second order: products of level and heading errors with themselves.
  const double heading = (dw + earth::rotation_rate * df / g + turning / g) / horizontal;
  return {1.05 * level + level * level, 1.05 * heading + heading * heading};
}

class Alignment : public ::testing::TestWithParam<Case> {};

TEST_P(Alignment, IsWithinWhatTheErrorsAllow) {
  const Case& c = GetParam();
  sim::SimConfig config = test::thrice_table5();
  config.latitude_deg = c.latitude_deg;
  config.roll_deg = c.attitude_deg.roll;
  config.pitch_deg = c.attitude_deg.pitch;
  config.heading_deg = c.attitude_deg.heading;
  if (c.moored) {
    config.base_motion = test::rough_mooring();
  }
  const Schedule dwell{{{0, 0}}, {span_s}, 5.0};
  const auto recording = sim::simulate(config, dwell, 1, {});  // seed 1
  ASSERT_TRUE(recording) << recording.error().message;
  const ImuData data = test::view_of(*recording);
  const CoarseAlignment found = coarse_alignment(data, span_s);

  // The gimbal misses its position by up to a degree; its read-out says where it stands.
  const sim::GimbalMotion gimbal({data.gimbal_outer[0], data.gimbal_inner[0]}, {});
  const auto imu = sim::ImuSimulator::create(config, gimbal, 1, {});
  ASSERT_TRUE(imu);
  const sim::MotionState start = imu->motion().at(0.0);
  const Bound bound = bound_for(config, start);
  const Vector3 phi = -rotation_vector_from_matrix(found.C_nb * start.C_nb.transpose());
  const double level = std::hypot(phi.x(), phi.z());
  EXPECT_LT(level, bound.level + 1e-4);  // 1e-4: four sigma of a read-out of the gimbal, 5 arcsec
  EXPECT_LT(std::abs(phi.y()), bound.heading + 1e-4);
  constexpr double linear_range = 0.2;
  EXPECT_LT(std::max(bound.level, bound.heading), linear_range);
}

std::vector<Case> cases() {
  std::vector<Case> all;
  // roll, pitch, heading: level, inverted, nose up and down (vertical), on its side, anyhow.
  const Attitude attitudes[] = {{0, 0, 0},     {0, 0, 135},  {180, 0, 60},  {0, 90, 20},
                                {0, -90, 200}, {90, 0, 300}, {37, -61, 250}};
  for (const double latitude : {-80.0, -33.0, 0.0, 40.0, 75.0, 80.0}) {
    for (const Attitude& attitude : attitudes) {
      all.push_back({attitude, latitude, false});
      all.push_back({attitude, latitude, true});
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Everywhere, Alignment, ::testing::ValuesIn(cases()));

// The trap of a moored base: gyros averaged for a minute. A sway of 0.5 deg at 8 s leaves 2 A/T = 60 deg/h at worst,
// four times the Earth's rate: the data of the test above are not harmless.
TEST(Alignment, AveragedGyrosWouldFail) {
  sim::SimConfig config = test::thrice_table5();
  config.base_motion = sim::moored_base_motion();
  const auto recording = sim::simulate(config, {{{0, 0}}, {span_s}, 5.0}, 1, {});
  ASSERT_TRUE(recording);
  double worst = 0.0;
  for (std::size_t first = 0; first + 12000 <= recording->size(); first += 100) {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = first; i < first + 12000; ++i) {
      sum += Eigen::Map<const Vector3>(recording->delta_theta_rad[i].data());
    }
    worst = std::max(worst, std::abs(sum.x() / 60.0) / units::degree_per_hour);
  }
  EXPECT_GT(worst, 45.0);  // deg/h; 15 of them would be the Earth's
}

}  // namespace
}  // namespace selfcal
