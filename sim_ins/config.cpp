#include "sim_ins/config.hpp"

#include <fmt/format.h>

#include "estimator/geometry/units.hpp"
#include "sim_ins/toml_reader.hpp"

namespace selfcal::sim {
namespace {

struct Range {
  std::string_view name;
  double low;
  double high;
};

// Ranges hold for files and for callers alike.
constexpr Range sample_rate{"sample_rate_hz", 50.0, 1000.0};
constexpr Range latitude{"latitude_deg", -89.0, 89.0};
constexpr Range longitude{"longitude_deg", -180.0, 360.0};
constexpr Range height{"height_m", -1000.0, 20000.0};
constexpr Range angle{"", -360.0, 360.0};
constexpr Range gyro_lsb{"gyro_lsb_arcsec", 1e-6, 100.0};
constexpr Range accel_lsb{"accel_lsb_m_per_s", 1e-10, 0.1};
constexpr Range arw{"gyro_arw_deg_per_sqrt_h", 0.0, 10.0};
constexpr Range vrw{"accel_vrw_ug_per_sqrt_hz", 0.0, 1e5};

void read(TomlTable& table, const Range& range, double& value) {
  table.number(range.name, value, range.low, range.high);
}

Expected<void> check(const Range& range, double value) {
  if (value >= range.low && value <= range.high) {
    return {};
  }
  return fail(ErrorKind::bad_input,
              fmt::format("{} = {} is outside [{}, {}]", range.name, value, range.low, range.high));
}

void read_sines(TomlTable& motion, std::string_view key, double si, std::vector<Sine>& sines) {
  motion.tables(key, [&](TomlTable& table) {
    double amplitude = 0.0;
    double period_s = 0.0;
    double phase_deg = 0.0;
    table.number("amplitude", amplitude, -1000.0, 1000.0);
    table.number("period_s", period_s, 0.05, 1e6);
    table.number("phase_deg", phase_deg, -360.0, 360.0);
    if (!table.has("period_s")) {
      table.refuse("period_s", "missing");
    }
    sines.push_back({amplitude * si, period_s, phase_deg * units::degree});
  });
}

// [base_motion] preset = "still" | "moored", or [[base_motion.roll]] amplitude (deg, or m for displacements) ...
void read_base_motion(TomlTable& table, BaseMotion& motion) {
  std::string preset = "still";
  table.text("preset", preset);
  if (preset == "moored") {
    motion = moored_base_motion();
  } else if (preset == "still") {
    motion = {};
  } else {
    table.refuse("preset", fmt::format("{}: known are still, moored", preset));
  }
  read_sines(table, "roll", units::degree, motion.roll);
  read_sines(table, "pitch", units::degree, motion.pitch);
  read_sines(table, "yaw", units::degree, motion.yaw);
  read_sines(table, "surge", 1.0, motion.surge);
  read_sines(table, "heave", 1.0, motion.heave);
  read_sines(table, "sway", 1.0, motion.sway);
}

void read_gimbal(TomlTable& table, GimbalConfig& gimbal) {
  table.number("max_rate_deg_per_s", gimbal.max_rate_deg_per_s, 0.01, 1000.0);
  table.number("max_acceleration_deg_per_s2", gimbal.max_acceleration_deg_per_s2, 0.01, 10000.0);
  table.number("ramp_s", gimbal.ramp_s, 0.01, 1000.0);
  table.number("positioning_error_deg", gimbal.positioning_error_deg, 0.0, 10.0);
  table.number("readout_noise_arcsec", gimbal.readout_noise_arcsec, 0.0, 36000.0);
}

void read_temperature(TomlTable& table, TemperatureConfig& temperature) {
  table.boolean("recorded", temperature.recorded);
  table.number("start_c", temperature.start_c, -100.0, 150.0);
  table.number("warm_up_c", temperature.warm_up_c, -100.0, 100.0);
  table.number("warm_up_tau_s", temperature.warm_up_tau_s, 1.0, 1e6);
  table.number("ramp_c_per_h", temperature.ramp_c_per_h, -100.0, 100.0);
  table.number("readout_noise_c", temperature.readout_noise_c, 0.0, 10.0);
}

void read_root(TomlTable& root, SimConfig& config) {
  root.text("serial", config.serial);
  read(root, sample_rate, config.sample_rate_hz);
  root.table("site", [&](TomlTable& site) {
    read(site, latitude, config.latitude_deg);
    read(site, longitude, config.longitude_deg);
    read(site, height, config.height_m);
  });
  root.table("attitude", [&](TomlTable& attitude) {
    attitude.number("roll_deg", config.roll_deg, angle.low, angle.high);
    attitude.number("pitch_deg", config.pitch_deg, angle.low, angle.high);
    attitude.number("heading_deg", config.heading_deg, angle.low, angle.high);
  });
  root.table("base_motion", [&](TomlTable& motion) { read_base_motion(motion, config.base_motion); });
  root.text("parameter_set", config.parameter_set);
  root.table("parameters", [&](TomlTable& parameters) {  // the table's names and units
    for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
      double value = 0.0;
      parameters.number(sensor_parameters[i].name, value, -1e6, 1e6);
      if (parameters.has(sensor_parameters[i].name)) {
        config.explicit_parameters[i] = value;
      }
    }
  });
  root.table("noise", [&](TomlTable& noise) {
    read(noise, arw, config.gyro_arw_deg_per_sqrt_h);
    read(noise, vrw, config.accel_vrw_ug_per_sqrt_hz);
    noise.number("gyro_bias_instability_deg_per_h", config.gyro_bias_instability_deg_per_h, 0.0, 100.0);
    noise.number("accel_bias_instability_ug", config.accel_bias_instability_ug, 0.0, 1e5);
    noise.number("bias_instability_tau_s", config.bias_instability_tau_s, 1.0, 1e6);
    read(noise, gyro_lsb, config.gyro_lsb_arcsec);
    read(noise, accel_lsb, config.accel_lsb_m_per_s);
  });
  root.table("gimbal", [&](TomlTable& gimbal) { read_gimbal(gimbal, config.gimbal); });
  root.table("temperature", [&](TomlTable& temperature) { read_temperature(temperature, config.temperature); });
}

}  // namespace

Expected<void> check_config(const SimConfig& config) {
  return check(sample_rate, config.sample_rate_hz)
      .and_then([&] { return check(latitude, config.latitude_deg); })
      .and_then([&] { return check(longitude, config.longitude_deg); })
      .and_then([&] { return check(height, config.height_m); })
      .and_then([&] { return check(arw, config.gyro_arw_deg_per_sqrt_h); })
      .and_then([&] { return check(vrw, config.accel_vrw_ug_per_sqrt_hz); })
      .and_then([&] { return check(gyro_lsb, config.gyro_lsb_arcsec); })
      .and_then([&] { return check(accel_lsb, config.accel_lsb_m_per_s); });
}

Expected<SimConfig> parse_sim_config(const std::string& text, const std::string& name) {
  SimConfig config;
  const auto read_all = read_toml(text, name, [&](TomlTable& root) { read_root(root, config); });
  if (!read_all) {
    return tl::unexpected(read_all.error());
  }
  return config;
}

Expected<SimConfig> read_sim_config(const std::string& path) {
  return read_text(path).and_then([&](const std::string& text) { return parse_sim_config(text, path); });
}

}  // namespace selfcal::sim
