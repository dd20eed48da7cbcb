#include "sim_ins/simulate.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "estimator/geometry/units.hpp"
#include "protocol/document/document_head.hpp"
#include "sim_ins/gimbal.hpp"
#include "sim_ins/imu_simulator.hpp"
#include "sim_ins/random.hpp"

namespace selfcal::sim {
namespace {

constexpr std::uint64_t errors_stream = 1;
constexpr std::uint64_t gimbal_stream = 2;

// The source's Table 3 and the turntable column of its Table 5, in the table's units and order. Its Table 3 gives K-
// as -100, which is taken as it stands.
constexpr SensorErrors table3 = {100, 100, 100, 0.01, 0.01, 0.01, 100, 100, 100, -100, -100, -100,
                                 30,  30,  30,  30,   30,   30,   30,  30,  30,  30,   30,   30};
constexpr SensorErrors table5 = {767, -505, -221, 0.0139, -0.0023, 0.0212, 162,  327, 263, -151, -286, -215,
                                 181, 119,  -314, 15,     9,       22,     -247, 1,   111, 149,  -72,  -256};

void append(Recording& recording, const SimConfig& config, const ImuSample& sample, std::size_t index) {
  const double theta_lsb = config.gyro_lsb_arcsec * units::arcsecond;
  const auto scaled = [](const std::array<std::int32_t, 3>& counts, double lsb) {
    return std::array<double, 3>{counts[0] * lsb, counts[1] * lsb, counts[2] * lsb};
  };
  recording.time_s.push_back(static_cast<double>(index + 1) / config.sample_rate_hz);
  recording.delta_theta_rad.push_back(scaled(sample.delta_theta, theta_lsb));
  recording.delta_v_mps.push_back(scaled(sample.delta_v, config.accel_lsb_m_per_s));
  recording.gimbal_outer_rad.push_back(sample.outer);
  recording.gimbal_inner_rad.push_back(sample.inner);
  if (config.temperature.recorded) {
    recording.temperature_c.push_back(sample.temperature_c);
  }
}

Recording empty_recording(const SimConfig& config, const Schedule& schedule, std::size_t samples) {
  Recording recording;
  recording.serial = config.serial;
  recording.sample_rate_hz = config.sample_rate_hz;
  recording.latitude_deg = config.latitude_deg;
  recording.longitude_deg = config.longitude_deg;
  recording.height_m = config.height_m;
  recording.rotation_s = schedule.rotation_s;
  const double dwell = schedule.dwell_s.front();
  bool same = true;
  for (const double other : schedule.dwell_s) {
    same = same && other == dwell;
  }
  if (same) {
    recording.dwell_s = dwell;
  }
  recording.temperature_channels = config.temperature.recorded ? 1 : 0;
  for (const GimbalPosition& position : schedule.positions) {
    recording.schedule_deg.push_back({position.outer_deg, position.inner_deg});
  }
  recording.time_s.reserve(samples);
  recording.delta_theta_rad.reserve(samples);
  recording.delta_v_mps.reserve(samples);
  recording.gimbal_outer_rad.reserve(samples);
  recording.gimbal_inner_rad.reserve(samples);
  recording.temperature_c.reserve(config.temperature.recorded ? samples : 0);
  return recording;
}

}  // namespace

const SensorErrors& random_spread() {
  static constexpr SensorErrors spread = {800, 800, 800, 0.025, 0.025, 0.025, 350, 350, 350, 350, 350, 350,
                                          320, 320, 320, 30,    30,    30,    260, 260, 260, 260, 260, 260};
  return spread;
}

Expected<SensorErrors> true_sensor_errors(const SimConfig& config, std::uint64_t seed) {
  SensorErrors errors{};  // in the table's units until the end
  if (config.parameter_set == "table3") {
    errors = table3;
  } else if (config.parameter_set == "table5") {
    errors = table5;
  } else if (config.parameter_set == "random") {
    Random random(seed, errors_stream);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      errors[i] = random_spread()[i] * random.uniform(-1.0, 1.0);
    }
  } else if (config.parameter_set != "none") {
    return fail(ErrorKind::bad_input,
                fmt::format("parameter_set {}: known are table3, table5, random, none", config.parameter_set));
  }
  for (std::size_t i = 0; i < errors.size(); ++i) {
    errors[i] = config.explicit_parameters[i].value_or(errors[i]) * sensor_parameters[i].si_per_unit;
  }
  return errors;
}

Expected<Recording> simulate(const SimConfig& config, const Schedule& schedule, std::uint64_t seed,
                             const ConcealedPhysics& physics) {
  if (const auto sound = check_schedule(config.gimbal, schedule); !sound) {
    return tl::unexpected(sound.error());
  }
  Random gimbal_random(seed, gimbal_stream);
  auto imu = ImuSimulator::create(config, plan_gimbal(config.gimbal, schedule, gimbal_random), seed, physics);
  if (!imu) {
    return tl::unexpected(imu.error());
  }
  const auto samples = static_cast<std::size_t>(std::llround(schedule.duration_s() * config.sample_rate_hz));
  Recording recording = empty_recording(config, schedule, samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const ImuSample sample = imu->next();
    if (!sample.missing) {
      append(recording, config, sample, k);
    }
  }
  return recording;
}

Expected<void> write_truth(const std::string& path, const SimConfig& config, std::uint64_t seed,
                           const ConcealedPhysics& physics) {
  const auto errors = true_sensor_errors(config, seed);
  if (!errors) {
    return tl::unexpected(errors.error());
  }
  nlohmann::ordered_json truth = document::head(document::truth);
  truth["serial"] = config.serial;
  truth["seed"] = seed;
  truth["parameters"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < errors->size(); ++i) {
    const SensorParameter& named = sensor_parameters[i];
    truth["parameters"].push_back(
        {{"name", named.name}, {"unit", named.unit}, {"value", (*errors)[i] / named.si_per_unit}});
  }
  truth["attitude_deg"] = {{"roll", config.roll_deg}, {"pitch", config.pitch_deg}, {"heading", config.heading_deg}};
  truth["gyro_arw_deg_per_sqrt_h"] = config.gyro_arw_deg_per_sqrt_h;
  truth["accel_vrw_ug_per_sqrt_hz"] = config.accel_vrw_ug_per_sqrt_hz;
  truth["effects"] = nlohmann::ordered_json::array();
  for (const PhysicsEffect& effect : physics.effects) {
    nlohmann::ordered_json values;
    for (const EffectDescription& known : physics_effects()) {
      for (std::size_t i = 0; known.id == effect.id && i < known.parameters.size(); ++i) {
        values[std::string(known.parameters[i].name)] = effect.values[i] / known.parameters[i].si_per_unit;
      }
    }
    truth["effects"].push_back({{"id", effect.id}, {"values", values}});
  }
  truth["laws"] = nlohmann::ordered_json::array();
  for (const Law& law : physics.laws) {
    const bool gyro = law.axis < 3;
    truth["laws"].push_back({{"axis", (gyro ? "gyro_" : "accel_") + std::string(1, "xyz"[law.axis % 3])},
                             {"expression", law.expression},
                             {"coefficient", law.coefficient / (gyro ? units::degree_per_hour : units::micro_g)},
                             {"unit", gyro ? "deg/h" : "ug"}});
  }
  std::ofstream file(path);
  file << truth.dump(1) << '\n';
  file.close();
  if (!file) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot be written", path));
  }
  return {};
}

}  // namespace selfcal::sim
