#include "sim_ins/sensor_physics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/geometry/units.hpp"

namespace selfcal::sim {
namespace {

using Values = std::span<const double>;
using Context = SensorContext;
using Deviation = SensorDeviation;

Vector3 vector_at(Values p, std::size_t first) { return {p[first], p[first + 1], p[first + 2]}; }

void gyro_g_sensitivity(Values p, const Context& c, Deviation& d) { d.domega += matrix_of(p) * c.u(); }

void gyro_magnetic_sensitivity(Values p, const Context& c, Deviation& d) {
  d.domega += matrix_of(p) * (c.C_nb.transpose() * vector_at(p, 9));
}

void gyro_scale_asymmetry(Values p, const Context& c, Deviation& d) {
  d.domega += vector_at(p, 0).cwiseProduct(c.omega_ib_b.cwiseAbs());
}

void gyro_scale_nonlinearity(Values p, const Context& c, Deviation& d) {
  const Vector3& w = c.omega_ib_b;
  d.domega += vector_at(p, 0).cwiseProduct(w.cwiseProduct(w.cwiseAbs()));
  d.domega += vector_at(p, 3).cwiseProduct(w.cwiseProduct(w).cwiseProduct(w));
}

// b (T - T_ref) + w (1 - exp(-t/tau)): values, three of b, three of w, tau, T_ref.
Vector3 thermal(Values p, const Context& c) {
  return vector_at(p, 0) * (temperature_at(*c.temperature, c.t) - p[7]) + vector_at(p, 3) * -std::expm1(-c.t / p[6]);
}
void gyro_temperature(Values p, const Context& c, Deviation& d) { d.domega += thermal(p, c); }
void accel_temperature(Values p, const Context& c, Deviation& d) { d.df += thermal(p, c); }

void gyro_drift_ramp(Values p, const Context& c, Deviation& d) { d.domega += vector_at(p, 0) * c.t; }
void accel_bias_ramp(Values p, const Context& c, Deviation& d) { d.df += vector_at(p, 0) * c.t; }

void gyro_scale_temperature(Values p, const Context& c, Deviation& d) {
  d.domega += thermal(p, c).cwiseProduct(c.omega_ib_b);
}
void accel_scale_temperature(Values p, const Context& c, Deviation& d) { d.df += thermal(p, c).cwiseProduct(c.f_ib_b); }

// Smooth lock-in -a tanh(w/width), and the hard threshold: the output stays zero below it and lags above it.
void gyro_dead_zone(Values p, const Context& c, Deviation& d) {
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double w = c.omega_ib_b[i];
    d.domega[i] -= p[k] * std::tanh(w / p[3]) + std::clamp(w, -std::abs(p[4 + k]), std::abs(p[4 + k]));
  }
}

void accel_quadratic(Values p, const Context& c, Deviation& d) {
  d.df += vector_at(p, 0).cwiseProduct(c.u().cwiseAbs2());
}
void accel_cubic(Values p, const Context& c, Deviation& d) {
  const Vector3 u = c.u();
  d.df += vector_at(p, 0).cwiseProduct(u.cwiseAbs2().cwiseProduct(u));
}

void accel_cross_coupling(Values p, const Context& c, Deviation& d) {
  constexpr std::array<std::array<std::pair<int, int>, 5>, 3> products{{{{{1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}},
                                                                        {{{0, 0}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}},
                                                                        {{{0, 0}, {1, 1}, {0, 2}, {1, 2}, {0, 1}}}}};
  const Vector3 u = c.u();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t k = 0; k < 5; ++k) {
      const auto [i, j] = products[axis][k];
      d.df[static_cast<int>(axis)] += p[5 * axis + k] * u[i] * u[j];
    }
  }
}
void accel_cross_squares(Values p, const Context& c, Deviation& d) {
  const Vector3 squares = c.u().cwiseAbs2();
  d.df += Vector3(p[0] * squares.y() + p[1] * squares.z(), p[2] * squares.x() + p[3] * squares.z(),
                  p[4] * squares.x() + p[5] * squares.y());
}

void accel_relaxation(Values p, const Context& c, Deviation& d) {
  if (c.since_turn_s >= 0.0) {
    d.df += vector_at(p, 0) * std::exp(-c.since_turn_s / p[3]);
  }
}

// Acceleration of a point fixed in b at r from the gimbal's centre, relative to the centre.
Vector3 centripetal(const Context& c, const Vector3& r) {
  return c.angular_acceleration.cross(r) + c.omega_ib_b.cross(c.omega_ib_b.cross(r));
}
void accel_size_effect(Values p, const Context& c, Deviation& d) {
  for (std::size_t i = 0; i < 3; ++i) {
    d.df[static_cast<int>(i)] += centripetal(c, vector_at(p, 3 * i))[static_cast<int>(i)];
  }
}
void imu_lever_arm(Values p, const Context& c, Deviation& d) { d.df += centripetal(c, vector_at(p, 0)); }

void triad_flexure(Values p, const Context& c, Deviation& d) { d.df += (matrix_of(p) * c.u()).cross(c.f_ib_b); }

// Beyond the catalogue. The bearing creeps back in jumps after a turn: the accelerometer triad stands off about z by
// `step`, and every interval from first_s on what is left shrinks by `decay`.
void bearing_stick_slip(Values p, const Context& c, Deviation& d) {
  if (c.since_turn_s < 0.0) {
    return;
  }
  const double slips = c.since_turn_s < p[1] ? 0.0 : 1.0 + std::floor((c.since_turn_s - p[1]) / p[2]);
  d.df += Vector3(0.0, 0.0, p[0] * std::pow(p[3], slips)).cross(c.f_ib_b);
}

void gyro_g_rate_sensitivity(Values p, const Context& c, Deviation& d) {
  d.domega += vector_at(p, 0).cwiseProduct(c.u()) * c.omega_ib_b.norm();
}

void lagged_thermal_gradient(Values p, const Context& c, Deviation& d) {
  const double rate = lagged_temperature_rate(*c.temperature, c.t, p[6]);
  d.domega += vector_at(p, 0) * rate;
  d.df += vector_at(p, 3) * rate;
}

// The proof mass rests where the last turn left it: the sign of the change of f decides.
void accel_turn_hysteresis(Values p, const Context& c, Deviation& d) {
  for (int i = 0; i < 3; ++i) {
    constexpr double noticed = 0.1;  // m/s^2: smaller changes leave the mass where it was
    const double change = c.turn_df[i];
    d.df[i] += std::abs(change) < noticed ? 0.0 : std::copysign(p[static_cast<std::size_t>(i)], change);
  }
}

void gyro_gimbal_field(Values p, const Context& c, Deviation& d) {
  d.domega += vector_at(p, 0) * std::sin(c.outer) + vector_at(p, 3) * std::sin(c.inner);
}

constexpr std::array<std::pair<std::string_view, SensorEquation>, 24> equations{{
    {"gyro_g_sensitivity", gyro_g_sensitivity},
    {"gyro_magnetic_sensitivity", gyro_magnetic_sensitivity},
    {"gyro_scale_asymmetry", gyro_scale_asymmetry},
    {"gyro_scale_nonlinearity", gyro_scale_nonlinearity},
    {"gyro_temperature", gyro_temperature},
    {"accel_temperature", accel_temperature},
    {"gyro_drift_ramp", gyro_drift_ramp},
    {"accel_bias_ramp", accel_bias_ramp},
    {"gyro_scale_temperature", gyro_scale_temperature},
    {"accel_scale_temperature", accel_scale_temperature},
    {"gyro_dead_zone", gyro_dead_zone},
    {"accel_quadratic", accel_quadratic},
    {"accel_cubic", accel_cubic},
    {"accel_cross_coupling", accel_cross_coupling},
    {"accel_cross_squares", accel_cross_squares},
    {"accel_relaxation", accel_relaxation},
    {"accel_size_effect", accel_size_effect},
    {"imu_lever_arm", imu_lever_arm},
    {"triad_flexure", triad_flexure},
    {"bearing_stick_slip", bearing_stick_slip},
    {"gyro_g_rate_sensitivity", gyro_g_rate_sensitivity},
    {"lagged_thermal_gradient", lagged_thermal_gradient},
    {"accel_turn_hysteresis", accel_turn_hysteresis},
    {"gyro_gimbal_field", gyro_gimbal_field},
}};

}  // namespace

Matrix3 matrix_of(std::span<const double> p) {
  Matrix3 m;
  m << p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8];
  return m;
}

Vector3 SensorContext::u() const { return f_ib_b / units::standard_gravity; }

SensorEquation sensor_equation(std::string_view effect_id) {
  const auto found =
      std::find_if(equations.begin(), equations.end(), [&](const auto& entry) { return entry.first == effect_id; });
  return found == equations.end() ? nullptr : found->second;
}

bool needs_angular_acceleration(std::string_view effect_id) {
  return effect_id == "accel_size_effect" || effect_id == "imu_lever_arm";
}

double temperature_at(const TemperatureConfig& config, double t) {
  return config.start_c - config.warm_up_c * std::expm1(-t / config.warm_up_tau_s) +
         config.ramp_c_per_h / units::hour * t;
}

double lagged_temperature_rate(const TemperatureConfig& config, double t, double tau_s) {
  // y' = (T' - y)/tau, y(0) = 0, T' = ramp + A exp(-t/tau_w): y is the sum of both answers. tau = tau_w is the limit
  // A t/tau exp(-t/tau), which a millionth of difference stands in for.
  const double ramp = config.ramp_c_per_h / units::hour;
  const double A = config.warm_up_c / config.warm_up_tau_s;
  const double w = config.warm_up_tau_s == tau_s ? tau_s * (1.0 + 1e-6) : config.warm_up_tau_s;
  return -ramp * std::expm1(-t / tau_s) + A * w / (w - tau_s) * (std::exp(-t / w) - std::exp(-t / tau_s));
}

}  // namespace selfcal::sim
