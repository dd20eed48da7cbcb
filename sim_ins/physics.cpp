#include "sim_ins/physics.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <numbers>

#include "estimator/geometry/units.hpp"

namespace selfcal::sim {
namespace {

using P = EffectParameter;

constexpr double dph = units::degree_per_hour;
constexpr double ug = units::micro_g;
constexpr double ppm = units::ppm;
constexpr double arcsec = units::arcsecond;
constexpr double revolution = 2.0 * std::numbers::pi;
constexpr double per_deg_s = 1.0 / units::degree;  // 1/(deg/s) in s/rad

// Three axes of one unit; and a 3 x 3 matrix, row (affected axis) first.
constexpr std::array<P, 3> axes(std::string_view unit, double si) {
  return {P{"x", unit, si}, P{"y", unit, si}, P{"z", unit, si}};
}
constexpr std::array<P, 9> matrix(std::string_view unit, double si) {
  return {P{"xx", unit, si}, P{"xy", unit, si}, P{"xz", unit, si}, P{"yx", unit, si}, P{"yy", unit, si},
          P{"yz", unit, si}, P{"zx", unit, si}, P{"zy", unit, si}, P{"zz", unit, si}};
}
template <std::size_t N, std::size_t M>
constexpr std::array<P, N + M> join(const std::array<P, N>& a, const std::array<P, M>& b) {
  std::array<P, N + M> all{};
  for (std::size_t i = 0; i < N; ++i) {
    all[i] = a[i];
  }
  for (std::size_t i = 0; i < M; ++i) {
    all[N + i] = b[i];
  }
  return all;
}
constexpr std::array<P, 3> warm_up(std::string_view unit, double si) {
  return {P{"warm_up_x", unit, si}, P{"warm_up_y", unit, si}, P{"warm_up_z", unit, si}};
}
constexpr P tau(double seconds) { return {"tau_s", "s", 1.0, seconds}; }
constexpr P reference{"reference_c", "degC", 1.0, 25.0};

constexpr auto gyro_g = matrix("deg/h/g", dph);
constexpr auto gyro_magnetic = join(
    matrix("deg/h/G", dph),
    std::array{P{"field_north", "G", 1.0, 0.28}, P{"field_up", "G", 1.0, -0.45}, P{"field_east", "G", 1.0, -0.03}});
constexpr auto gyro_asymmetry = axes("ppm", ppm);
constexpr std::array gyro_nonlinearity{P{"x", "ppm/(deg/s)", ppm* per_deg_s},
                                       P{"y", "ppm/(deg/s)", ppm* per_deg_s},
                                       P{"z", "ppm/(deg/s)", ppm* per_deg_s},
                                       P{"cubic_x", "ppm/(deg/s)^2", ppm* per_deg_s* per_deg_s},
                                       P{"cubic_y", "ppm/(deg/s)^2", ppm* per_deg_s* per_deg_s},
                                       P{"cubic_z", "ppm/(deg/s)^2", ppm* per_deg_s* per_deg_s}};
constexpr auto gyro_temperature =
    join(join(axes("deg/h/degC", dph), warm_up("deg/h", dph)), std::array{tau(600.0), reference});
constexpr auto accel_temperature =
    join(join(axes("ug/degC", ug), warm_up("ug", ug)), std::array{tau(600.0), reference});
constexpr auto gyro_ramp = axes("deg/h/h", dph / units::hour);
constexpr auto accel_ramp = axes("ug/h", ug / units::hour);
constexpr auto scale_temperature =
    join(join(axes("ppm/degC", ppm), warm_up("ppm", ppm)), std::array{tau(600.0), reference});
constexpr auto dead_zone =
    join(axes("deg/h", dph), std::array{P{"width", "deg/h", dph, 5.0}, P{"threshold_x", "deg/h", dph},
                                        P{"threshold_y", "deg/h", dph}, P{"threshold_z", "deg/h", dph}});
constexpr auto quadratic = axes("ug/g^2", ug);
constexpr auto cubic = axes("ug/g^3", ug);
// With the squares, as files have it that were written before these were an effect of their own.
constexpr std::array cross{P{"x_yy", "ug/g^2", ug}, P{"x_zz", "ug/g^2", ug}, P{"x_xy", "ug/g^2", ug},
                           P{"x_xz", "ug/g^2", ug}, P{"x_yz", "ug/g^2", ug}, P{"y_xx", "ug/g^2", ug},
                           P{"y_zz", "ug/g^2", ug}, P{"y_xy", "ug/g^2", ug}, P{"y_yz", "ug/g^2", ug},
                           P{"y_xz", "ug/g^2", ug}, P{"z_xx", "ug/g^2", ug}, P{"z_yy", "ug/g^2", ug},
                           P{"z_xz", "ug/g^2", ug}, P{"z_yz", "ug/g^2", ug}, P{"z_xy", "ug/g^2", ug}};
constexpr std::array cross_squares{P{"x_yy", "ug/g^2", ug}, P{"x_zz", "ug/g^2", ug}, P{"y_xx", "ug/g^2", ug},
                                   P{"y_zz", "ug/g^2", ug}, P{"z_xx", "ug/g^2", ug}, P{"z_yy", "ug/g^2", ug}};
constexpr auto relaxation = join(axes("ug", ug), std::array{tau(60.0)});
constexpr auto accel_lag = join(matrix("ug/g", ug), std::array{tau(60.0)});
constexpr auto gyro_lag = join(matrix("deg/h/g", dph), std::array{tau(60.0)});
constexpr auto accel_heat = join(axes("ug/rev", ug / revolution), std::array{tau(300.0)});
constexpr auto gyro_heat = join(axes("deg/h/rev", dph / revolution), std::array{tau(300.0)});
constexpr auto size_effect = matrix("cm", 0.01);  // rows: accelerometer, columns: its place in b
constexpr auto lever_arm = axes("cm", 0.01);
constexpr std::array time_offset{P{"tau", "ms", 1e-3}};
constexpr auto flexure = matrix("arcsec/g", arcsec);
constexpr std::array sway{P{"roll", "deg", units::degree}, P{"pitch", "deg", units::degree},
                          P{"yaw", "deg", units::degree},  P{"surge", "cm", 0.01},
                          P{"heave", "cm", 0.01},          P{"sway", "cm", 0.01},
                          P{"period_s", "s", 1.0, 8.0},    P{"phase", "deg", units::degree}};
constexpr std::array settling{P{"roll", "arcsec", arcsec}, P{"pitch", "arcsec", arcsec},
                              P{"heave", "mm", 1e-3},      tau(300.0),
                              P{"surge", "mm", 1e-3},      P{"sway", "mm", 1e-3}};
constexpr auto gyro_noise = axes("deg/sqrt(h)", units::degree_per_sqrt_hour);
constexpr auto accel_noise = axes("ug/sqrt(Hz)", units::micro_g_per_sqrt_hz);
constexpr auto gyro_walk = axes("deg/h/sqrt(h)", dph / 60.0);  // 60 = sqrt(3600 s)
constexpr auto accel_walk = axes("ug/sqrt(h)", ug / 60.0);
constexpr auto gyro_instability = join(axes("deg/h", dph), std::array{tau(300.0)});
constexpr auto accel_instability = join(axes("ug", ug), std::array{tau(300.0)});
constexpr std::array quantum{P{"gyro_lsb", "arcsec", arcsec}, P{"accel_lsb", "m/s", 1.0}};
constexpr std::array integral_noise{P{"gyro_x", "arcsec", arcsec}, P{"gyro_y", "arcsec", arcsec},
                                    P{"gyro_z", "arcsec", arcsec}, P{"accel_x", "m/s", 1.0},
                                    P{"accel_y", "m/s", 1.0},      P{"accel_z", "m/s", 1.0}};
constexpr std::array vibration{P{"gyro_x", "deg/h", dph},
                               P{"gyro_y", "deg/h", dph},
                               P{"gyro_z", "deg/h", dph},
                               P{"accel_x", "ug", ug},
                               P{"accel_y", "ug", ug},
                               P{"accel_z", "ug", ug},
                               P{"frequency_hz", "Hz", 1.0, 19.0},
                               P{"phase", "deg", units::degree}};
// mode 0: increments are zero; 1: the increment before is repeated; 2: the sample is missing.
constexpr std::array lost{P{"start_s", "s", 1.0}, P{"count", "1", 1.0, 1.0}, P{"every_s", "s", 1.0},
                          P{"mode", "1", 1.0}};
constexpr std::array clock_scale{P{"scale", "ppm", ppm}};
constexpr std::array stick_slip{P{"step", "arcsec", arcsec}, P{"first_s", "s", 1.0, 20.0},
                                P{"interval_s", "s", 1.0, 30.0}, P{"decay", "1", 1.0, 0.5}};
constexpr auto g_rate = axes("deg/h/g/(deg/s)", dph* per_deg_s);
constexpr std::array lagged{P{"gyro_x", "deg/h/(degC/h)", dph* units::hour},
                            P{"gyro_y", "deg/h/(degC/h)", dph* units::hour},
                            P{"gyro_z", "deg/h/(degC/h)", dph* units::hour},
                            P{"accel_x", "ug/(degC/h)", ug* units::hour},
                            P{"accel_y", "ug/(degC/h)", ug* units::hour},
                            P{"accel_z", "ug/(degC/h)", ug* units::hour},
                            tau(300.0)};
constexpr auto hysteresis = axes("ug", ug);
constexpr std::array gimbal_field{P{"outer_x", "deg/h", dph}, P{"outer_y", "deg/h", dph}, P{"outer_z", "deg/h", dph},
                                  P{"inner_x", "deg/h", dph}, P{"inner_y", "deg/h", dph}, P{"inner_z", "deg/h", dph}};

constexpr std::array<EffectDescription, 42> effects{{
    {"gyro_g_sensitivity", true, gyro_g},
    {"gyro_magnetic_sensitivity", true, gyro_magnetic},
    {"gyro_scale_asymmetry", true, gyro_asymmetry},
    {"gyro_scale_nonlinearity", true, gyro_nonlinearity},
    {"gyro_temperature", true, gyro_temperature},
    {"accel_temperature", true, accel_temperature},
    {"gyro_drift_ramp", true, gyro_ramp},
    {"accel_bias_ramp", true, accel_ramp},
    {"gyro_scale_temperature", true, scale_temperature},
    {"accel_scale_temperature", true, scale_temperature},
    {"gyro_dead_zone", true, dead_zone},
    {"accel_quadratic", true, quadratic},
    {"accel_cubic", true, cubic},
    {"accel_cross_coupling", true, cross},
    {"accel_cross_squares", true, cross_squares},
    {"accel_relaxation", true, relaxation},
    {"accel_load_lag", true, accel_lag},
    {"gyro_load_lag", true, gyro_lag},
    {"accel_turn_heat", true, accel_heat},
    {"gyro_turn_heat", true, gyro_heat},
    {"accel_size_effect", true, size_effect},
    {"imu_lever_arm", true, lever_arm},
    {"accel_gyro_time_offset", true, time_offset},
    {"triad_flexure", true, flexure},
    {"base_sway", true, sway},
    {"base_settling", true, settling},
    {"gyro_noise_level", true, gyro_noise},
    {"accel_noise_level", true, accel_noise},
    {"gyro_random_walk", true, gyro_walk},
    {"accel_random_walk", true, accel_walk},
    {"quantisation", true, quantum},
    {"vibration_line", true, vibration},
    {"lost_samples", true, lost},
    {"time_base", true, clock_scale},
    {"gyro_bias_instability", false, gyro_instability},
    {"accel_bias_instability", false, accel_instability},
    {"integral_noise", false, integral_noise},
    {"bearing_stick_slip", false, stick_slip},
    {"gyro_g_rate_sensitivity", false, g_rate},
    {"lagged_thermal_gradient", false, lagged},
    {"accel_turn_hysteresis", false, hysteresis},
    {"gyro_gimbal_field", false, gimbal_field},
}};

}  // namespace

std::span<const EffectDescription> physics_effects() { return effects; }

double value_of(const PhysicsEffect& effect, std::string_view parameter) {
  const auto known = std::ranges::find(physics_effects(), effect.id, &EffectDescription::id);
  assert(known != physics_effects().end());
  const auto named = std::ranges::find(known->parameters, parameter, &EffectParameter::name);
  assert(named != known->parameters.end());
  return effect.values[static_cast<std::size_t>(named - known->parameters.begin())];
}

}  // namespace selfcal::sim
