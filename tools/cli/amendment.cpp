#include "tools/cli/amendment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "daemon/estimate/showing_schedule.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/models/segments.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Diagnosis;
using diagnosis::Finding;
using diagnosis::FindingParameter;

constexpr double finest_count = 1e-2;  // of the quantum assumed

std::string key_value(std::string_view key, double value) { return fmt::format("{} = {:.9g}\n", key, value); }
std::string effect_head(std::string_view id) { return fmt::format("\n[[effect]]\nid = \"{}\"\n", id); }

// The simulation's base moves along the vehicle, the diagnosis sees it along n.
std::array<double, 3> along_vehicle(double north, double up, double east, double heading) {
  return {north * std::cos(heading) + east * std::sin(heading), up,
          east * std::cos(heading) - north * std::sin(heading)};
}
constexpr std::array<const char*, 3> vehicle_axes = {"surge", "heave", "sway"};

std::map<std::string, double> values_of(const Finding& f) {
  std::map<std::string, double> values;
  for (const FindingParameter& p : f.parameters) {
    values[p.name] = p.value;
  }
  return values;
}

std::string settling_text(const Finding& f, double heading) {
  std::map<std::string, double> v = values_of(f);
  const std::array<double, 3> moved = along_vehicle(v["north"], v["up"], v["east"], heading);
  std::string text = effect_head(f.effect);
  for (std::size_t k = 0; k < 3; ++k) {
    text += key_value(vehicle_axes[k], moved[k]);
  }
  return text + key_value("tau_s", v["tau"]);
}

// One line of the file for each axis: they have phases of their own.
std::string sway_text(const Finding& f, double heading) {
  std::map<std::string, double> v = values_of(f);
  const std::array<double, 3> sine = along_vehicle(v["north_sin"], v["up_sin"], v["east_sin"], heading);
  const std::array<double, 3> cosine = along_vehicle(v["north_cos"], v["up_cos"], v["east_cos"], heading);
  constexpr double mm_per_cm = 10.0;
  std::string text;
  for (std::size_t k = 0; k < 3; ++k) {
    text += effect_head(f.effect) + key_value(vehicle_axes[k], std::hypot(sine[k], cosine[k]) / mm_per_cm) +
            key_value("period_s", 1.0 / v["frequency"]) +
            key_value("phase", std::atan2(cosine[k], sine[k]) / units::degree);
  }
  return text;
}

// The simulation adds to the noise of its configuration, which has what was assumed or, if less was found, that.
std::string noise_text(const Finding& f, const diagnosis::AssumedNoise& assumed) {
  const double known = f.effect == "gyro_noise_level" ? assumed.gyro_arw / units::degree_per_sqrt_hour
                                                      : assumed.accel_vrw / units::micro_g_per_sqrt_hz;
  const double found = f.parameters.front().value;
  if (found <= known) {
    return fmt::format("\n# {}: {:.4g} {} where {:.4g} was assumed: stands in the configuration\n", f.effect, found,
                       f.parameters.front().unit, known);
  }
  const double more = std::sqrt(found * found - known * known);
  return effect_head(f.effect) + key_value("x", more) + key_value("y", more) + key_value("z", more);
}

// A quantum is one for a triad and makes the same noise on its axes. Where they differ, or one has it alone, it is white noise of the
// integral, as dither leaves it; a coarse quantum at a slow steady rate would be lines instead. The increments' own quantum stays.
bool is_integral_noise(const Finding& f) {
  constexpr double alike = 1.1;
  const auto by_value = [](const FindingParameter& a, const FindingParameter& b) { return a.value < b.value; };
  const auto [least, most] = std::minmax_element(f.parameters.begin(), f.parameters.end(), by_value);
  return f.parameters.size() < 3 || most->value > alike * least->value;
}

std::string integral_noise_text(const Finding& f, const CalibrationResult& calibration) {
  const bool gyro = f.parameters.front().name.starts_with("gyro");
  const double own = gyro ? calibration.gyro_quantum / units::arcsecond : calibration.accel_quantum;
  std::string text = own > 0.0 ? effect_head("quantisation") + key_value(gyro ? "gyro_lsb" : "accel_lsb", own) : "";
  text += effect_head("integral_noise");
  for (const FindingParameter& p : f.parameters) {
    text += key_value(p.name, std::sqrt(std::max(0.0, p.value * p.value - own * own) / 12.0));
  }
  return text;
}

std::string quantum_text(const Finding& f) {
  double gyro = 0.0, accel = 0.0;
  for (const FindingParameter& p : f.parameters) {
    double& largest = p.name.starts_with("gyro") ? gyro : accel;
    largest = std::max(largest, p.value);
  }
  return effect_head(f.effect) + key_value("gyro_lsb", gyro) + key_value("accel_lsb", accel);
}

std::string equation_text(const Finding& f, double mean_temperature_c, double latitude) {
  std::string text = effect_head(f.effect);
  for (const FindingParameter& p : f.parameters) {
    text += p.physics_key.empty() ? key_value(p.name, p.value) : key_value(p.physics_key, p.physics_value);
  }
  if (f.source == nullptr) {
    return text;
  }
  if (f.source->temperature == diagnosis::TemperatureUse::measured) {
    text += key_value("reference_c", mean_temperature_c);
  }
  if (f.source->needs_heading) {  // the field that the coefficients were found with
    const Vector3 field = diagnosis::dipole_field(latitude);
    text += key_value("field_north", field(0)) + key_value("field_up", field(1)) + key_value("field_east", field(2));
  }
  return text;
}

// In the finding's unit. What was assumed stands unless the diagnosis found less; more of it is in the physics file.
double density(const Diagnosis& d, std::string_view effect, double assumed) {
  const auto found =
      std::find_if(d.findings.begin(), d.findings.end(), [&](const Finding& f) { return f.effect == effect; });
  return found != d.findings.end() ? std::min(found->parameters.front().value, assumed) : assumed;
}

// Where quanta or lines were named the noise is not white: the simulation then draws it by its spectra, lines included.
bool has_spectra(const Diagnosis& d) {
  return std::any_of(d.findings.begin(), d.findings.end(),
                     [](const Finding& f) { return f.effect == "quantisation" || f.effect == "vibration_line"; });
}

// What the spectra hold.
bool in_spectra(const Finding& f) {
  return f.effect == "quantisation" || f.effect == "vibration_line" || f.effect == "gyro_noise_level" ||
         f.effect == "accel_noise_level";
}

// What the recording counts in; where it has no counts the simulation's own are fine enough.
double gyro_count(const Diagnosis& d, const diagnosis::AssumedNoise& assumed) {
  return d.calibration.gyro_quantum > 0.0 ? d.calibration.gyro_quantum : finest_count * assumed.gyro_quantum;
}
double accel_count(const Diagnosis& d, const diagnosis::AssumedNoise& assumed) {
  return d.calibration.accel_quantum > 0.0 ? d.calibration.accel_quantum : finest_count * assumed.accel_quantum;
}

std::string loudness_text(const std::vector<diagnosis::BandLoudness>& bands) {
  std::string text;
  for (const diagnosis::BandLoudness& band : bands) {
    std::string powers;
    for (const double power : band.power) {
      powers += fmt::format("{}{:.3g}", powers.empty() ? "" : ", ", power);
    }
    text += "[[spectrum.loudness]]\n" + key_value("below_hz", band.below_hz) + key_value("step_s", band.step_s) +
            fmt::format("power = [{}]\n", powers);
  }
  return text;
}

std::string spectrum_text(std::string_view channel, std::string_view unit, double si_per_unit,
                          const diagnosis::DensityTable& table, const std::string& more = {}) {
  std::string edges, densities;
  for (const double hz : table.edges_hz) {
    edges += fmt::format("{}{:.6g}", edges.empty() ? "" : ", ", hz);
  }
  for (const double density : table.density) {
    densities += fmt::format("{}{:.4g}", densities.empty() ? "" : ", ", density / si_per_unit);
  }
  return table.density.empty() ? ""
                               : fmt::format(
                                     "\n[[spectrum]]\nchannel = \"{}\"\nunit = \"{}\"\nedges_hz = [{}]\n"
                                     "density = [{}]\n",
                                     channel, unit, edges, densities) +
                                     more + loudness_text(table.loudness);
}

std::string tilt_text(std::string_view channel, const diagnosis::TiltSpectrum& tilt) {
  std::string heights;
  for (const double above_m : tilt.above_m) {
    heights += fmt::format("{}{:.4g}", heights.empty() ? "" : ", ", above_m);
  }
  return spectrum_text(channel, "arcsec/sqrt(Hz)", units::arcsecond, tilt.table,
                       fmt::format("above_m = [{}]\n", heights));
}

// A phase of its own each, spread by the golden section: no two lines start alike.
std::string line_text(const diagnosis::CoherentLine& line, double phase_deg) {
  constexpr std::array<const char*, 6> names = {"gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"};
  return fmt::format("\n[[effect]]\nid = \"vibration_line\"\n{} = {:.5g}\nfrequency_hz = {:.7g}\nphase = {:.4g}\n",
                     names.at(static_cast<std::size_t>(line.axis)),
                     line.amplitude / (line.axis < 3 ? units::degree_per_hour : units::micro_g), line.frequency_hz,
                     phase_deg);
}

std::string lines_text(const std::vector<diagnosis::CoherentLine>& lines) {
  constexpr double golden_deg = 222.4922359;
  std::string text;
  double phase_deg = 0.0;
  for (const diagnosis::CoherentLine& line : lines) {
    text += line_text(line, phase_deg);
    phase_deg = std::fmod(phase_deg + golden_deg, 360.0);
  }
  return text;
}

std::string spectra_text(const diagnosis::NoiseSpectra& spectra) {
  constexpr std::array<const char*, 6> names = {"gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"};
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k) {
    text += k < 3 ? spectrum_text(names[k], "deg/h/sqrt(Hz)", units::degree_per_hour, spectra.sensors[k])
                  : spectrum_text(names[k], "ug/sqrt(Hz)", units::micro_g, spectra.sensors[k]);
  }
  return text + tilt_text("base_roll", spectra.roll) + tilt_text("base_pitch", spectra.pitch);
}

}  // namespace

std::string physics_text(const Diagnosis& d, const diagnosis::AssumedNoise& assumed, double latitude,
                         const std::optional<diagnosis::NoiseSpectra>& spectra) {
  std::string text = "# Physics that a diagnosis found left out; sim_ins and selfcal simulate load it.\n";
  const double heading = d.calibration.initial_attitude.heading;
  for (const Finding& f : d.findings) {
    const bool moves = f.source != nullptr && f.source->displacement != nullptr;
    if (spectra && in_spectra(f)) {
      continue;
    }
    if (moves && f.source->constant.kind == diagnosis::EffectConstant::Kind::spectrum) {
      text += sway_text(f, heading);
    } else if (moves) {
      text += settling_text(f, heading);
    } else if (f.effect == "quantisation") {
      text += is_integral_noise(f) ? integral_noise_text(f, d.calibration) : quantum_text(f);
    } else if (f.effect == "gyro_noise_level" || f.effect == "accel_noise_level") {
      text += noise_text(f, assumed);
    } else {
      text += equation_text(f, d.mean_temperature_c, latitude);
    }
  }
  return spectra ? text + lines_text(spectra->lines) + spectra_text(*spectra) : text;
}

std::string sim_config_text(const Diagnosis& d, const diagnosis::AssumedNoise& assumed, const Recording& recording,
                            bool spectra) {
  const Attitude& attitude = d.calibration.initial_attitude;
  std::string text = "# What a diagnosis makes of a recording: load it with the physics file beside it.\n";
  if (d.unexplained) {
    text += "# WARNING: nothing explains the recording. The 24 values below are biased by what is missing.\n";
  }
  text += fmt::format("serial = \"{}\"\nparameter_set = \"none\"\n", recording.serial);
  text += key_value("sample_rate_hz", recording.sample_rate_hz);
  text += "\n[site]\n" + key_value("latitude_deg", recording.latitude_deg) +
          key_value("longitude_deg", recording.longitude_deg) + key_value("height_m", recording.height_m);
  text += "\n[attitude]\n" + key_value("roll_deg", attitude.roll / units::degree) +
          key_value("pitch_deg", attitude.pitch / units::degree) +
          key_value("heading_deg", attitude.heading / units::degree);
  const double gyro_arw = density(d, "gyro_noise_level", assumed.gyro_arw / units::degree_per_sqrt_hour),
               accel_vrw = density(d, "accel_noise_level", assumed.accel_vrw / units::micro_g_per_sqrt_hz);
  text += "\n[noise]\n" + key_value("gyro_arw_deg_per_sqrt_h", spectra ? 0.0 : gyro_arw) +
          key_value("accel_vrw_ug_per_sqrt_hz", spectra ? 0.0 : accel_vrw) +
          key_value("gyro_lsb_arcsec", (spectra ? gyro_count(d, assumed) : assumed.gyro_quantum) / units::arcsecond) +
          key_value("accel_lsb_m_per_s", spectra ? accel_count(d, assumed) : assumed.accel_quantum);
  text += "\n[gimbal]\npositioning_error_deg = 0\n";
  // Values that nothing determines are of per cents: a gyro's scale factor of 4 % would part the tilt that it feels from gravity's.
  text += "\n[parameters]\n";
  text += d.nothing_turned ? "# Nothing turned: the recording tells none of these.\n" : "";
  for (int k = 0; k < sensor_parameter_count; ++k) {
    const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(k)];
    text += key_value(p.name, d.nothing_turned ? 0.0 : d.value_as_named(k) / p.si_per_unit);
  }
  return text;
}

Expected<void> write_amendment(const std::filesystem::path& folder, const Diagnosis& d,
                               const diagnosis::AssumedNoise& assumed, const Recording& recording, const ImuData& data,
                               const std::string& laws) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", folder.string(), error.message()));
  }
  std::optional<diagnosis::NoiseSpectra> spectra;
  if (has_spectra(d)) {
    spectra =
        diagnosis::noise_spectra(data, find_segments(data), d.calibration.gyro_quantum, d.calibration.accel_quantum);
  }
  return write_file_atomically(folder / "physics.toml", physics_text(d, assumed, data.site.latitude, spectra) + laws)
      .and_then([&] {
        return write_file_atomically(folder / "sim.toml", sim_config_text(d, assumed, recording, spectra.has_value()));
      })
      .and_then([&] {
        return write_file_atomically(folder / "schedule.toml", format_schedule(schedule_of(recording, data)));
      });
}

}  // namespace selfcal::cli
