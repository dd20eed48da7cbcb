// What the virtual INS is: site, host, gimbal, sensors, noise, temperature. Human units at this edge, named.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/error.hpp"
#include "sim_ins/base_motion.hpp"

namespace selfcal::sim {

// The 24 true sensor errors in the order of selfcal::sensor_parameters, SI.
using SensorErrors = std::array<double, sensor_parameter_count>;

// The gimbal drive. A move takes the schedule's rotation_s exactly: rate up over ramp_s, constant, down over ramp_s,
// the ramps being half cosine waves, so that angular acceleration is continuous.
struct GimbalConfig {
  double max_rate_deg_per_s = 30.0;
  double max_acceleration_deg_per_s2 = 60.0;
  double ramp_s = 1.5;                 // shortened to rotation_s / 2 where it does not fit
  double positioning_error_deg = 1.0;  // each position is missed by a uniform error within +- this, per axis
  double readout_noise_arcsec = 5.0;   // 1 sigma of an angle read-out, white
};

struct TemperatureConfig {
  bool recorded = true;  // the recording has a temperature channel
  double start_c = 25.0;
  double warm_up_c = 8.0;  // T(t) = start + warm_up (1 - exp(-t/tau)) + ramp t
  double warm_up_tau_s = 1200.0;
  double ramp_c_per_h = 0.0;
  double readout_noise_c = 0.02;
};

struct SimConfig {
  std::string serial = "SIM-0001";
  double sample_rate_hz = 200.0;  // 50 to 1000
  double latitude_deg = 40.0;
  double longitude_deg = 116.0;
  double height_m = 50.0;
  double roll_deg = 0.0;  // mean attitude of the host
  double pitch_deg = 0.0;
  double heading_deg = 30.0;
  BaseMotion base_motion;  // still unless set; moored_base_motion() is the reference recordings'

  // Where the 24 errors come from: "table3", "table5", "random" (drawn from the seed, uniform within the typical
  // spreads of random_spread()), "none"; then explicit values replace single ones.
  std::string parameter_set = "table3";
  std::array<std::optional<double>, sensor_parameter_count> explicit_parameters;  // in the table's units

  double gyro_arw_deg_per_sqrt_h = 0.001;
  double accel_vrw_ug_per_sqrt_hz = 5.0;
  // Bias instability as a first-order Gauss-Markov process, 1 sigma and correlation time; 0: none.
  double gyro_bias_instability_deg_per_h = 0.0;
  double accel_bias_instability_ug = 0.0;
  double bias_instability_tau_s = 600.0;
  double gyro_lsb_arcsec = 0.1;  // increments are counts of this; what is cut off is carried on
  double accel_lsb_m_per_s = 2e-6;

  GimbalConfig gimbal;
  TemperatureConfig temperature;
};

// Half-widths of the uniform draw of "random", in the table's units, like the Table 5 unit's.
const SensorErrors& random_spread();

// Reads sim.toml. An unknown key, a wrong type or a value out of range is bad_input naming file, line and key.
[[nodiscard]] Expected<SimConfig> read_sim_config(const std::string& path);
// The same from text; `name` stands for the file in messages.
[[nodiscard]] Expected<SimConfig> parse_sim_config(const std::string& text, const std::string& name);
// What no reader checks because it needs no file: ranges of every value. bad_input naming the value.
[[nodiscard]] Expected<void> check_config(const SimConfig& config);

}  // namespace selfcal::sim
