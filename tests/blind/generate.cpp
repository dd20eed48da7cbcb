// Generator of the blind trial. Links the virtual INS's truth and no diagnosis.
//
//   selfcal_blind_generate key SEED CLEAN REPEATS FIRST FILE   appends what is missing of the first cases to the key,
//                                                         one JSON line each
//   selfcal_blind_generate record SEED CLEAN REPEATS KEY N FILE
//                                                         writes the recording of case N, prints what is assumed
//   selfcal_blind_generate draw SEED CLEAN REPEATS N FILE both of case N alone: its recording; its line of the key and
//                                                         what is assumed as one JSON object
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "protocol/recording/recording_file.hpp"
#include "sim_ins/simulate.hpp"
#include "tests/blind/plan.hpp"

namespace {

using namespace selfcal;
using nlohmann::ordered_json;

std::vector<double> listed(const ParameterVector& v) { return {v.data(), v.data() + v.size()}; }

ordered_json assumed(const sim::SimConfig& c) {
  return {{"gyro_arw_deg_per_sqrt_h", c.gyro_arw_deg_per_sqrt_h},
          {"accel_vrw_ug_per_sqrt_hz", c.accel_vrw_ug_per_sqrt_hz},
          {"gyro_lsb_arcsec", c.gyro_lsb_arcsec},
          {"accel_lsb_m_per_s", c.accel_lsb_m_per_s}};
}

ordered_json to_json(const blind::ConcealedEffect& e) {
  ordered_json values;
  for (const auto& known : sim::physics_effects()) {
    for (std::size_t k = 0; known.id == e.physics.id && k < known.parameters.size(); ++k) {
      values[std::string(known.parameters[k].name)] = e.physics.values[k] / known.parameters[k].si_per_unit;
    }
  }
  ordered_json j = {{"id", e.physics.id}, {"values", values}, {"sigmas", e.response.sigmas}};
  if (e.response.sigmas > 0.0) {
    j["shift"] = listed(e.response.shift);
    j["sigma_24"] = listed(e.response.sigma);
  }
  if (e.unlike_sigmas >= 0.0) {
    j["unlike_sigmas"] = e.unlike_sigmas;
  }
  if (e.augmented_sigma(0) > 0.0) {
    j["augmented_sigma_24"] = listed(e.augmented_sigma);
  }
  return j;
}

Expected<ordered_json> to_json(const blind::Case& c) {
  const auto truth = sim::true_sensor_errors(c.config, c.seed);
  if (!truth) {
    return tl::unexpected(truth.error());
  }
  ordered_json j;
  j["number"] = c.number;
  j["stratum"] = c.recipe.stratum;
  j["strength"] = c.recipe.strength;
  j["seed"] = c.seed;
  j["dwell_s"] = c.schedule.dwell_s.front();
  j["rotation_s"] = c.schedule.rotation_s;
  j["last_outer_deg"] = c.schedule.positions[13].outer_deg;  // where the two named schedules differ
  j["rate_hz"] = c.config.sample_rate_hz;
  j["site_deg"] = {c.config.latitude_deg, c.config.longitude_deg};
  j["attitude_deg"] = {c.config.roll_deg, c.config.pitch_deg, c.config.heading_deg};
  j["temperature"] = c.config.temperature.recorded;
  j["moored"] = !c.config.base_motion.still();
  j["assumed"] = assumed(c.config);
  j["truth"] = *truth;
  j["effects"] = ordered_json::array();
  for (const auto& e : c.effects) {
    j["effects"].push_back(to_json(e));
  }
  return j;
}

int complain(const Error& error) {
  fmt::print(stderr, "selfcal_blind_generate: {}\n", error.message);
  return static_cast<int>(error.kind);
}

int write_key(const std::vector<blind::Recipe>& recipes, std::uint64_t seed, const std::string& path) {
  int done = 0;
  {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      ++done;
    }
  }
  std::ofstream file(path, std::ios::app);
  for (int n = done; n < static_cast<int>(recipes.size()); ++n) {
    const auto drawn = blind::draw_case(recipes[static_cast<std::size_t>(n)], n, seed);
    if (!drawn) {
      return complain(drawn.error());
    }
    const auto line = to_json(*drawn);
    if (!line) {
      return complain(line.error());
    }
    file << line->dump() << '\n' << std::flush;
  }
  file.close();
  if (!file) {
    return complain({ErrorKind::bad_input, fmt::format("{}: cannot be written", path)});
  }
  return 0;
}

// The key's line of this case.
Expected<std::string> line_of(const std::string& key, int number) {
  std::ifstream file(key);
  std::string line;
  for (int n = -1; n < number; ++n) {
    if (!std::getline(file, line)) {
      return fail(ErrorKind::bad_input, fmt::format("{}: no case {}", key, number));
    }
  }
  return line;
}

// The physics that it holds.
Expected<sim::ConcealedPhysics> physics_in(const std::string& line, int number) {
  sim::ConcealedPhysics physics;
  const auto j = nlohmann::json::parse(line, nullptr, false);
  if (j.is_discarded() || !j.contains("effects")) {
    return fail(ErrorKind::bad_input, fmt::format("key: line {} is no case", number + 1));
  }
  for (const auto& e : j.at("effects")) {
    sim::PhysicsEffect effect{e.at("id").get<std::string>(), {}};
    for (const auto& known : sim::physics_effects()) {
      for (std::size_t k = 0; known.id == effect.id && k < known.parameters.size(); ++k) {
        effect.values.push_back(e.at("values").at(std::string(known.parameters[k].name)).get<double>() *
                                known.parameters[k].si_per_unit);
      }
    }
    physics.effects.push_back(effect);
  }
  return physics;
}

// What `printed` makes of what is assumed.
template <typename Printed>
int write_one(const blind::Case& c, const std::string& line, const std::string& path, const Printed& printed) {
  const auto physics = physics_in(line, c.number);
  if (!physics) {
    return complain(physics.error());
  }
  const auto recording = sim::simulate(c.config, c.schedule, c.seed, *physics);
  if (!recording) {
    return complain(recording.error());
  }
  if (const auto written = write_recording(*recording, path); !written) {
    return complain(written.error());
  }
  fmt::print("{}\n", printed(assumed(c.config)).dump());
  return 0;
}

int write_recorded(const blind::Case& c, const std::string& key, const std::string& path) {
  const auto line = line_of(key, c.number);
  return line ? write_one(c, *line, path, [](ordered_json noise) { return noise; }) : complain(line.error());
}

int write_drawn(const blind::Recipe& recipe, int number, std::uint64_t seed, const std::string& path) {
  const auto drawn = blind::draw_case(recipe, number, seed);
  const auto line = drawn ? to_json(*drawn) : tl::unexpected(drawn.error());
  if (!line) {
    return complain(line.error());
  }
  return write_one(blind::draw_installation(recipe, number, seed), line->dump(), path, [&](const ordered_json& noise) {
    return ordered_json{{"case", *line}, {"assumed", noise}};
  });
}

template <typename T>
bool parse(const char* text, T& value) {
  const std::string_view s = text;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  return error == std::errc() && end == s.data() + s.size();
}

int run(std::span<char*> a) {
  std::uint64_t seed = 0;
  blind::TrialSize size;
  int number = 0;
  std::size_t first = 0;
  const std::string command = a.size() > 1 ? a[1] : "";
  const bool key = command == "key" && a.size() == 7;
  const bool record = command == "record" && a.size() == 8;
  const bool draw = command == "draw" && a.size() == 7;
  if ((!key && !record && !draw) || !parse(a[2], seed) || !parse(a[3], size.clean) || !parse(a[4], size.repeats) ||
      (record && !parse(a[6], number)) || (draw && !parse(a[5], number)) || (key && !parse(a[5], first))) {
    fmt::print(stderr,
               "usage: selfcal_blind_generate key SEED CLEAN REPEATS FIRST FILE\n"
               "       selfcal_blind_generate record SEED CLEAN REPEATS KEY NUMBER FILE\n"
               "       selfcal_blind_generate draw SEED CLEAN REPEATS NUMBER FILE\n");
    return 2;
  }
  auto recipes = blind::recipes(size, seed);
  if (key) {
    recipes.resize(std::min(recipes.size(), first));
    return write_key(recipes, seed, a[6]);
  }
  if (number < 0 || number >= static_cast<int>(recipes.size())) {
    return complain({ErrorKind::usage, fmt::format("case {}: there are {}", number, recipes.size())});
  }
  const blind::Recipe& recipe = recipes[static_cast<std::size_t>(number)];
  return draw ? write_drawn(recipe, number, seed, a[6])
              : write_recorded(blind::draw_installation(recipe, number, seed), a[5], a[7]);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv, static_cast<std::size_t>(argc)});
  } catch (const std::exception& e) {  // a key that was edited: a value of another type, a missing name
    std::fprintf(stderr, "selfcal_blind_generate: %s\n", e.what());
    return 3;
  }
}
