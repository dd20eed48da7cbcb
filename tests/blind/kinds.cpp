#include "tests/blind/kinds.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "estimator/geometry/units.hpp"

namespace selfcal::blind {
namespace {

using sim::EffectDescription;
using Names = std::vector<std::string_view>;

const Names axes = {"x", "y", "z"};
const Names matrix = {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"};
const Names warm_up = {"warm_up_x", "warm_up_y", "warm_up_z"};
const Names products = {"x_xy", "x_xz", "x_yz", "y_xy", "y_yz", "y_xz", "z_xz", "z_yz", "z_xy"};
const Names squares = {"x_yy", "x_zz", "y_xx", "y_zz", "z_xx", "z_yy"};
const DrawnConstant thermal_tau{"tau_s", 150.0, 1500.0};

const EffectDescription& description(std::string_view id) {
  const auto all = sim::physics_effects();
  return *std::find_if(all.begin(), all.end(), [&](const EffectDescription& d) { return d.id == id; });
}

// Position of a parameter in the description.
std::size_t place(const EffectDescription& d, std::string_view name) {
  std::size_t k = 0;
  while (d.parameters[k].name != name) {
    ++k;
  }
  return k;
}

const std::vector<Kind>& table() {
  using enum KindGroup;
  static const std::vector<Kind> all = {
      {"gyro_g_sensitivity", catalogue, matrix, 0.02, {}, {}, 0.0},
      {"gyro_magnetic_sensitivity", catalogue, matrix, 0.03, {}, {}, 0.0},
      {"gyro_scale_asymmetry", catalogue, axes, 10.0, {}, {}, 0.0},
      {"gyro_scale_nonlinearity", catalogue, axes, 1.0, {}, {}, 0.0},
      {"gyro_temperature", catalogue, axes, 0.002, {thermal_tau}, warm_up, 0.02},
      {"accel_temperature", catalogue, axes, 5.0, {thermal_tau}, warm_up, 30.0},
      {"gyro_drift_ramp", catalogue, axes, 0.02, {}, {}, 0.0},
      {"accel_bias_ramp", catalogue, axes, 20.0, {}, {}, 0.0},
      {"gyro_scale_temperature", catalogue, axes, 2.0, {}, {}, 0.0},
      {"accel_scale_temperature", catalogue, axes, 2.0, {}, {}, 0.0},
      {"gyro_dead_zone", catalogue, axes, 0.01, {{"width", 0.2, 20.0}}, {}, 0.0},
      {"accel_quadratic", catalogue, axes, 20.0, {}, {}, 0.0},
      {"accel_cubic", catalogue, axes, 10.0, {}, {}, 0.0},
      {"accel_cross_coupling", catalogue, products, 20.0, {}, {}, 0.0},
      {"accel_cross_squares", catalogue, squares, 20.0, {}, {}, 0.0},
      {"accel_relaxation", catalogue, axes, 50.0, {{"tau_s", 15.0, 120.0}}, {}, 0.0},
      {"accel_load_lag", catalogue, matrix, 20.0, {{"tau_s", 15.0, 120.0}}, {}, 0.0},
      {"gyro_load_lag", catalogue, matrix, 0.02, {{"tau_s", 15.0, 120.0}}, {}, 0.0},
      {"accel_turn_heat", catalogue, axes, 100.0, {{"tau_s", 100.0, 600.0}}, {}, 0.0},
      {"gyro_turn_heat", catalogue, axes, 0.05, {{"tau_s", 100.0, 600.0}}, {}, 0.0},
      {"accel_size_effect", catalogue, matrix, 1.0, {}, {}, 0.0},
      {"imu_lever_arm", catalogue, axes, 1.0, {}, {}, 0.0},
      {"accel_gyro_time_offset", catalogue, {"tau"}, 0.3, {}, {}, 0.0},
      {"triad_flexure", catalogue, matrix, 2.0, {}, {}, 0.0},
      {"base_sway", catalogue, {"surge", "heave", "sway"}, 0.01, {{"period_s", 5.0, 20.0}}, {}, 0.0},
      {"base_settling", catalogue, {"heave"}, 0.1, {{"tau_s", 60.0, 600.0}}, {}, 0.0},
      {"bearing_stick_slip", outside, {"step"}, 2.0, {}, {}, 0.0},
      {"gyro_g_rate_sensitivity", outside, axes, 0.02, {}, {}, 0.0},
      {"lagged_thermal_gradient", outside, {"gyro_x", "gyro_y", "gyro_z"}, 0.001, {{"tau_s", 100.0, 600.0}}, {}, 0.0},
      {"accel_turn_hysteresis", outside, axes, 20.0, {}, {}, 0.0},
      {"gyro_gimbal_field",
       outside,
       {"outer_x", "outer_y", "outer_z", "inner_x", "inner_y", "inner_z"},
       0.01,
       {},
       {},
       0.0},
      {"time_base", invisible, {"scale"}, 5.0, {}, {}, 0.0},
      {"gyro_noise_level", noise, axes, 0.0, {}, {}, 0.0},
      {"accel_noise_level", noise, axes, 0.0, {}, {}, 0.0},
      {"gyro_random_walk", noise, axes, 0.05, {}, {}, 0.0},
      {"accel_random_walk", noise, axes, 60.0, {}, {}, 0.0},
      {"quantisation", noise, {"gyro_lsb"}, 1.0, {}, {}, 0.0},
      {"vibration_line", noise, {"gyro_x", "gyro_y", "gyro_z"}, 2.0, {{"frequency_hz", 4.0, 20.0}}, {}, 0.0},
  };
  return all;
}

const Names& components(const Kind& kind, const sim::SimConfig& config) {
  return config.temperature.recorded || kind.without_temperature.empty() ? kind.components : kind.without_temperature;
}

// A field that is not quite the axial dipole which the diagnosis takes the Earth for: each part is off by up to 10 %,
// with 10 % of declination.
void draw_field(const EffectDescription& d, const sim::SimConfig& config, sim::Random& random,
                std::vector<double>& values) {
  constexpr double equator = 0.31, deviation = 0.1;
  const double latitude = config.latitude_deg * units::degree;
  values[place(d, "field_north")] = equator * std::cos(latitude) * (1.0 + random.uniform(-deviation, deviation));
  values[place(d, "field_up")] = -2.0 * equator * std::sin(latitude) * (1.0 + random.uniform(-deviation, deviation));
  values[place(d, "field_east")] = equator * random.uniform(-deviation, deviation);
}

}  // namespace

std::span<const Kind> kinds() { return table(); }

const Kind& kind_called(std::string_view id) {
  return *std::find_if(table().begin(), table().end(), [&](const Kind& k) { return k.id == id; });
}

sim::PhysicsEffect draw_effect(const Kind& kind, const sim::SimConfig& config, sim::Random& random) {
  const EffectDescription& d = description(kind.id);
  sim::PhysicsEffect effect{std::string(kind.id), {}};
  for (const auto& p : d.parameters) {
    effect.values.push_back(p.default_value * p.si_per_unit);
  }
  const Names& names = components(kind, config);
  const double typical = &names == &kind.components ? kind.typical : kind.typical_without_temperature;
  const bool one = random.uniform() < 0.5;
  const auto only = static_cast<std::size_t>(random.uniform() * static_cast<double>(names.size()));
  for (std::size_t k = 0; k < names.size(); ++k) {
    const double draw = one ? (k == only ? 1.0 : 0.0) : random.normal();
    const std::size_t at = place(d, names[k]);
    effect.values[at] = draw * typical * d.parameters[at].si_per_unit;
  }
  for (const DrawnConstant& c : kind.constants) {
    const std::size_t at = place(d, c.name);
    effect.values[at] = std::exp(random.uniform(std::log(c.low), std::log(c.high))) * d.parameters[at].si_per_unit;
  }
  if (kind.id == "gyro_magnetic_sensitivity") {
    draw_field(d, config, random, effect.values);
  }
  return effect;
}

sim::PhysicsEffect scaled(const Kind& kind, const sim::PhysicsEffect& effect, double factor) {
  const EffectDescription& d = description(kind.id);
  sim::PhysicsEffect result = effect;
  for (const Names* names : {&kind.components, &kind.without_temperature}) {
    for (const std::string_view name : *names) {
      result.values[place(d, name)] *= factor;
    }
  }
  return result;
}

void set_reference_temperature(sim::PhysicsEffect& effect, double celsius) {
  const EffectDescription& d = description(effect.id);
  for (std::size_t k = 0; k < d.parameters.size(); ++k) {
    if (d.parameters[k].name == "reference_c") {
      effect.values[k] = celsius;
    }
  }
}

std::vector<Column> columns_of(const Kind& kind, const sim::SimConfig& config, const sim::PhysicsEffect& effect,
                               double size) {
  const EffectDescription& d = description(kind.id);
  const Names& names = components(kind, config);
  const double typical = &names == &kind.components ? kind.typical : kind.typical_without_temperature;
  std::vector<Column> columns;
  for (const std::string_view name : names) {
    sim::PhysicsEffect one = scaled(kind, effect, 0.0);
    const std::size_t at = place(d, name);
    one.values[at] = typical * d.parameters[at].si_per_unit;
    columns.push_back({{{one}}, {}, 1.0, size, 0.0, 0.0});
  }
  // Warm-ups have a constant only where they are what shows.
  const bool measured = !kind.without_temperature.empty() && &names == &kind.components;
  for (const DrawnConstant& c : kind.constants) {
    if (measured) {
      continue;
    }
    constexpr double step = 0.05;
    sim::PhysicsEffect above = effect, below = effect;
    above.values[place(d, c.name)] *= std::exp(step);
    below.values[place(d, c.name)] *= std::exp(-step);
    columns.push_back({{{above}}, {{below}}, 2.0 * step, std::log(c.high / c.low) / std::sqrt(12.0), 0.0, 0.0});
  }
  // A scale that follows a temperature without a channel: the block's own time constant is unknown.
  if (!config.temperature.recorded && kind.id.ends_with("_scale_temperature")) {
    constexpr double step = 0.05, spread = 0.5;  // drawn from 300 to 1500 s: sigma of its logarithm
    const double tau = config.temperature.warm_up_tau_s;
    columns.push_back({{{effect}}, {{effect}}, 2.0 * step, spread, tau * std::exp(step), tau * std::exp(-step)});
  }
  return columns;
}

}  // namespace selfcal::blind
