#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "estimator/geometry/units.hpp"
#include "protocol/toml_file/nearest_word.hpp"
#include "sim_ins/physics.hpp"
#include "sim_ins/toml_reader.hpp"

namespace selfcal::sim {
namespace {

std::vector<std::string_view> known_ids() {
  std::vector<std::string_view> ids;
  for (const EffectDescription& description : physics_effects()) {
    ids.push_back(description.id);
  }
  return ids;
}

void read_effect(TomlTable& table, ConcealedPhysics& physics) {
  PhysicsEffect effect;
  table.text("id", effect.id);
  const EffectDescription* known = nullptr;
  for (const EffectDescription& description : physics_effects()) {
    known = description.id == effect.id ? &description : known;
  }
  if (known == nullptr) {
    table.refuse("id", effect.id.empty()
                           ? "missing"
                           : fmt::format("no effect is called {}{}", effect.id,
                                         did_you_mean(effect.id, std::span<const std::string_view>(known_ids()))));
    return;
  }
  for (const EffectParameter& parameter : known->parameters) {
    double value = parameter.default_value;
    constexpr double any = std::numeric_limits<double>::max();
    // A time constant or period of zero would divide by zero, a lead time before the start has no meaning.
    const bool positive = parameter.default_value > 0.0 && parameter.unit != "degC" && parameter.unit != "G";
    table.number(parameter.name, value, positive ? 1e-9 : -any, any);
    effect.values.push_back(value * parameter.si_per_unit);
  }
  physics.effects.push_back(std::move(effect));
}

constexpr std::array<std::string_view, 6> axis_names = {"gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"};

struct ProcessName {
  std::string_view name;
  LawProcess process;
  double time_unit;  // the coefficient is per square root of it
};
constexpr std::array<ProcessName, 4> processes = {{{"jump per turn", LawProcess::jump_per_turn, 1.0},
                                                   {"random walk", LawProcess::random_walk, units::hour},
                                                   {"white", LawProcess::white, 1.0},
                                                   {"line", LawProcess::line, 1.0}}};

// A process in place of an expression; false: the table is refused.
bool read_process(TomlTable& table, const std::string& name, Law& law) {
  const auto known =
      std::find_if(processes.begin(), processes.end(), [&](const ProcessName& p) { return p.name == name; });
  if (known == processes.end()) {
    table.refuse("process", fmt::format("no process is called {}", name));
    return false;
  }
  law.process = known->process;
  law.coefficient /= std::sqrt(known->time_unit);
  if (law.process == LawProcess::line) {
    constexpr double fastest_hz = 1e5;
    if (!table.has("frequency_hz")) {
      table.refuse("frequency_hz", "missing");
    }
    table.number("frequency_hz", law.frequency_hz, 1e-6, fastest_hz);
  }
  return true;
}

void read_law(TomlTable& table, ConcealedPhysics& physics) {
  Law law;
  std::string axis, unit, process;
  table.text("axis", axis);
  table.text("unit", unit);
  table.text("expression", law.expression);
  table.text("process", process);
  double sigma = 0.0;
  constexpr double any = std::numeric_limits<double>::max();
  table.number("sigma", sigma, 0.0, any);  // the diagnosis writes it; the truth has none
  table.table("constants", [](TomlTable& constants) { constants.ignore(); });
  const auto found = std::find(axis_names.begin(), axis_names.end(), axis);
  if (found == axis_names.end()) {
    return table.refuse("axis", axis.empty() ? "missing" : fmt::format("no axis is called {}", axis));
  }
  law.axis = static_cast<int>(found - axis_names.begin());
  const bool gyro = law.axis < 3;
  if (unit != (gyro ? "deg/h" : "ug")) {
    return table.refuse("unit", fmt::format("\"{}\" where {} is in {}", unit, axis, gyro ? "deg/h" : "ug"));
  }
  if (!table.has("coefficient")) {
    return table.refuse("coefficient", "missing");
  }
  table.number("coefficient", law.coefficient, -any, any);
  law.coefficient *= gyro ? units::degree_per_hour : units::micro_g;
  if (law.expression.empty() == process.empty()) {
    return table.refuse("expression", "either an expression or a process");
  }
  if (!process.empty()) {
    if (!read_process(table, process, law)) {
      return;
    }
  } else if (const auto compiled = LawEvaluator::compile(law.expression); !compiled) {
    return table.refuse("expression", compiled.error().message);
  } else {
    law.uses_temperature = compiled->uses_temperature();
  }
  physics.laws.push_back(std::move(law));
}

struct ChannelName {
  std::string_view name, unit;
  double si_per_unit;
};
// In the order of NoiseSpectrum::Channel.
constexpr std::array<ChannelName, 8> channels = {{{"gyro_x", "deg/h/sqrt(Hz)", units::degree_per_hour},
                                                  {"gyro_y", "deg/h/sqrt(Hz)", units::degree_per_hour},
                                                  {"gyro_z", "deg/h/sqrt(Hz)", units::degree_per_hour},
                                                  {"accel_x", "ug/sqrt(Hz)", units::micro_g},
                                                  {"accel_y", "ug/sqrt(Hz)", units::micro_g},
                                                  {"accel_z", "ug/sqrt(Hz)", units::micro_g},
                                                  {"base_roll", "arcsec/sqrt(Hz)", units::arcsecond},
                                                  {"base_pitch", "arcsec/sqrt(Hz)", units::arcsecond}}};

void read_loudness(TomlTable& table, NoiseSpectrum& spectrum) {
  constexpr double fastest_hz = 1e6, least_step_s = 0.01, most_step_s = 1e5, most = 1e9;
  constexpr std::size_t most_powers = 1'000'000, most_bands = 32;
  BandLoudness loudness;
  table.number("below_hz", loudness.below_hz, 0.0, fastest_hz);
  table.number("step_s", loudness.step_s, least_step_s, most_step_s);
  table.numbers("power", loudness.power, 0.0, most);
  const double before = spectrum.loudness.empty() ? 0.0 : spectrum.loudness.back().below_hz;
  if (!(loudness.below_hz > before)) {
    return table.refuse("below_hz", fmt::format("{} Hz is not above {} Hz", loudness.below_hz, before));
  }
  if (loudness.power.empty() || loudness.power.size() > most_powers) {
    return table.refuse("power", fmt::format("{} values where 1 to {} are taken", loudness.power.size(), most_powers));
  }
  constexpr double longest_s = 1e5;
  if (loudness.step_s * static_cast<double>(loudness.power.size()) > longest_s) {
    return table.refuse("power", fmt::format("{} values every {} s are longer than {} s", loudness.power.size(),
                                             loudness.step_s, longest_s));
  }
  if (spectrum.loudness.size() == most_bands) {
    return table.refuse("below_hz", fmt::format("more than {} bands", most_bands));
  }
  spectrum.loudness.push_back(std::move(loudness));
}

void read_spectrum(TomlTable& table, ConcealedPhysics& physics) {
  NoiseSpectrum spectrum;
  std::string channel, unit;
  table.text("channel", channel);
  table.text("unit", unit);
  constexpr double fastest_hz = 1e6, most = 1e12;
  table.numbers("edges_hz", spectrum.edges_hz, 0.0, fastest_hz);
  table.numbers("density", spectrum.density, 0.0, most);
  const auto found =
      std::find_if(channels.begin(), channels.end(), [&](const ChannelName& c) { return c.name == channel; });
  if (found == channels.end()) {
    return table.refuse("channel", channel.empty() ? "missing" : fmt::format("no channel is called {}", channel));
  }
  if (unit != found->unit) {
    return table.refuse("unit", fmt::format("\"{}\" where {} is in {}", unit, channel, found->unit));
  }
  if (found - channels.begin() >= static_cast<std::ptrdiff_t>(NoiseSpectrum::Channel::base_roll)) {
    constexpr double farthest_m = 1000.0;
    table.number_or_numbers("above_m", spectrum.above_m, spectrum.density.size(), -farthest_m, farthest_m);
    if (!spectrum.above_m.empty() && spectrum.above_m.size() != spectrum.density.size()) {
      return table.refuse("above_m", fmt::format("{} heights where there are {} densities", spectrum.above_m.size(),
                                                 spectrum.density.size()));
    }
  }
  table.tables("loudness", [&](TomlTable& band) { read_loudness(band, spectrum); });
  if (spectrum.density.empty() || spectrum.edges_hz.size() != spectrum.density.size() + 1) {
    return table.refuse("edges_hz", fmt::format("{} edges where {} densities need one more", spectrum.edges_hz.size(),
                                                spectrum.density.size()));
  }
  constexpr double narrowest_hz = 1e-6;
  for (std::size_t k = 0; k + 1 < spectrum.edges_hz.size(); ++k) {
    if (!(spectrum.edges_hz[k + 1] - spectrum.edges_hz[k] >= narrowest_hz)) {
      return table.refuse("edges_hz", fmt::format("{} after {} Hz does not rise by {} Hz", spectrum.edges_hz[k + 1],
                                                  spectrum.edges_hz[k], narrowest_hz));
    }
  }
  for (double& density : spectrum.density) {
    density *= found->si_per_unit;
  }
  spectrum.channel = static_cast<NoiseSpectrum::Channel>(found - channels.begin());
  for (const NoiseSpectrum& other : physics.spectra) {
    if (other.channel == spectrum.channel) {
      return table.refuse("channel", fmt::format("{} has a spectrum already", channel));
    }
  }
  physics.spectra.push_back(std::move(spectrum));
}

}  // namespace

Expected<ConcealedPhysics> parse_physics(const std::string& text, const std::string& name) {
  ConcealedPhysics physics;
  const auto read = read_toml(text, name, [&](TomlTable& root) {
    root.tables("effect", [&](TomlTable& table) { read_effect(table, physics); });
    root.tables("law", [&](TomlTable& table) { read_law(table, physics); });
    root.tables("spectrum", [&](TomlTable& table) { read_spectrum(table, physics); });
  });
  if (!read) {
    return tl::unexpected(read.error());
  }
  return physics;
}

Expected<ConcealedPhysics> read_physics(const std::string& path) {
  return read_text(path).and_then([&](const std::string& text) { return parse_physics(text, path); });
}

}  // namespace selfcal::sim
