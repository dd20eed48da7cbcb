// Generator of the discovery trial. Links the virtual INS's truth, one pass of the filter for strengths, and no diagnosis.
//
//   selfcal_discovery_generate key SEED LAWS PAIRS PROCESSES CLEAN FOREIGN EFFECTS BESIDE DEEP MIXED FILE   one JSON line a case, as far as missing
//   selfcal_discovery_generate record KEY NUMBER FILE        the recording of a case
//   selfcal_discovery_generate draw SEED LAWS PAIRS PROCESSES CLEAN FOREIGN EFFECTS BESIDE DEEP MIXED NUMBER FILE   a case's recording; prints its line of
//                                                            the key as "case", and for the program that asks what is left as "assumed"
//   selfcal_discovery_generate again KEY NUMBER FILE K PLAN  the same unit on the same base for the K-th time, with other noise, on
//                                                            another schedule: a file, or "random:SECONDS"
//   selfcal_discovery_generate possible KEY NUMBER COUNT     so many laws as that of the case, drawn in the same way, and its own: "AXIS EXPRESSION"
//   selfcal_discovery_generate left KEY NUMBER LAWS.toml     share of the misfit's power that these laws leave on a plan
//                                                            that was never used: |true - told|^2 / |true|^2
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "estimator/geometry/units.hpp"
#include "protocol/recording/recording_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "sim_ins/simulate.hpp"
#include "tests/blind/response.hpp"
#include "tests/discovery/drawn.hpp"

namespace {

using namespace selfcal;
using discovery_trial::Case;
using nlohmann::ordered_json;

int complain(const Error& error) {
  fmt::print(stderr, "selfcal_discovery_generate: {}\n", error.message);
  return static_cast<int>(error.kind);
}

std::optional<int> to_number(const char* text) {
  char* end = nullptr;
  const long value = std::strtol(text, &end, 10);
  return end != text && *end == '\0' && value >= 0 && value < 1000000000 ? std::optional<int>(static_cast<int>(value))
                                                                         : std::nullopt;
}

ordered_json to_json(const Case& c, std::uint64_t trial_seed) {
  ordered_json j = {{"number", c.number},
                    {"trial_seed", trial_seed},
                    {"kind", c.kind},
                    {"strength", c.strength},
                    {"attitude_deg", {c.config.roll_deg, c.config.pitch_deg, c.config.heading_deg}},
                    {"temperature", c.config.temperature.recorded},
                    {"moored", !c.config.base_motion.still()}};
  const auto truth = sim::true_sensor_errors(c.config, c.seed);
  if (truth) {
    j["truth"] = *truth;
  }
  if (c.bound.sum() > 0.0) {
    j["bound"] = std::vector<double>(c.bound.begin(), c.bound.end());
  }
  j["effects"] = ordered_json::array();
  for (const sim::PhysicsEffect& effect : c.physics.effects) {
    j["effects"].push_back(effect.id);
  }
  j["effect_sigmas"] = c.effect_sigmas;
  j["effect_values"] = ordered_json::array();  // SI
  for (const sim::PhysicsEffect& effect : c.physics.effects) {
    j["effect_values"].push_back(std::vector<double>(effect.values.begin(), effect.values.end()));
  }
  j["laws"] = ordered_json::array();
  for (const sim::Law& law : c.physics.laws) {
    const bool gyro = law.axis < 3;
    j["laws"].push_back({{"axis", law.axis},
                         {"expression", law.expression},
                         {"process", static_cast<int>(law.process)},
                         {"coefficient", law.coefficient / (gyro ? units::degree_per_hour : units::micro_g)}});
  }
  return j;
}

std::vector<discovery_trial::Recipe> recipes_of(const ordered_json& counts, std::uint64_t seed) {
  return discovery_trial::recipes({counts.at(0), counts.at(1), counts.at(2), counts.at(3), counts.at(4), counts.at(5),
                                   counts.at(6), counts.at(7), counts.at(8)},
                                  seed);
}

// What a key follows from: its seed and the number of cases of each kind.
struct Drawing {
  std::uint64_t seed = 0;
  ordered_json counts = ordered_json::array();

  Expected<ordered_json> line(int number, Case* drawn = nullptr) const {
    const auto recipes = recipes_of(counts, seed);
    if (number < 0 || number >= static_cast<int>(recipes.size())) {
      return fail(ErrorKind::usage, fmt::format("case {}: there are {}", number, recipes.size()));
    }
    auto c = discovery_trial::draw_case(recipes[static_cast<std::size_t>(number)], number, seed);
    if (!c) {
      return tl::unexpected(c.error());
    }
    ordered_json told = to_json(*c, seed);
    told["counts"] = counts;
    if (drawn != nullptr) {
      *drawn = std::move(*c);
    }
    return told;
  }
};

// SEED LAWS PAIRS PROCESSES CLEAN FOREIGN EFFECTS BESIDE DEEP MIXED
Expected<Drawing> drawing_in(std::span<char*> words) {
  const auto seed = to_number(words[0]);
  if (!seed) {
    return fail(ErrorKind::usage, fmt::format("{}: no seed", words[0]));
  }
  Drawing drawing{static_cast<std::uint64_t>(*seed), ordered_json::array()};
  for (std::size_t k = 1; k < 10; ++k) {
    const auto count = to_number(words[k]);
    if (!count) {
      return fail(ErrorKind::usage, fmt::format("{}: no count", words[k]));
    }
    drawing.counts.push_back(*count);
  }
  return drawing;
}

int write_key(std::span<char*> arguments) {
  const auto drawing = drawing_in(arguments);
  if (!drawing) {
    return complain(drawing.error());
  }
  int done = 0;
  {
    std::ifstream file(arguments[10]);
    for (std::string line; std::getline(file, line);) {
      ++done;
    }
  }
  std::ofstream file(arguments[10], std::ios::app);
  for (int n = done; n < static_cast<int>(recipes_of(drawing->counts, drawing->seed).size()); ++n) {
    const auto line = drawing->line(n);
    if (!line) {
      return complain(line.error());
    }
    file << line->dump() << '\n' << std::flush;
  }
  return file ? 0 : complain({ErrorKind::bad_input, fmt::format("{}: cannot be written", arguments[10])});
}

// The case whose line of the key has this number.
Expected<Case> case_in(const std::string& key, int number) {
  std::ifstream file(key);
  for (std::string line; std::getline(file, line);) {
    const ordered_json j = ordered_json::parse(line);
    if (j.at("number") == number) {
      const auto recipes = recipes_of(j.at("counts"), j.at("trial_seed"));
      return discovery_trial::draw_case(recipes.at(static_cast<std::size_t>(number)), number, j.at("trial_seed"));
    }
  }
  return fail(ErrorKind::bad_input, fmt::format("{}: no case {}", key, number));
}

int write_record(const Case& c, const std::string& path) {
  const auto recording = sim::simulate(c.config, c.schedule, c.seed, c.physics);
  if (!recording) {
    return complain(recording.error());
  }
  const auto written = write_recording(*recording, path);
  return written ? 0 : complain(written.error());
}

int draw(std::span<char*> arguments) {
  const auto drawing = drawing_in(arguments);
  const auto number = to_number(arguments[10]);
  if (!drawing || !number) {
    return complain(drawing ? Error{ErrorKind::usage, fmt::format("{}: no case", arguments[10])} : drawing.error());
  }
  Case drawn;
  const auto line = drawing->line(*number, &drawn);
  if (!line) {
    return complain(line.error());
  }
  fmt::print("{}\n", ordered_json{{"case", *line}, {"assumed", *line}}.dump());
  return write_record(drawn, arguments[11]);
}

int print_possible(const Case& c, int count) {
  for (const sim::Law& law : discovery_trial::possible_laws(c, static_cast<std::size_t>(count))) {
    fmt::print("{} {}\n", law.axis, law.expression);
  }
  return 0;
}

int print_left(const Case& c, const std::string& laws) {
  const auto told = sim::read_physics(laws);
  if (!told) {
    return complain(told.error());
  }
  const auto filtered =
      blind::Filtered::make(discovery_trial::other_installation(c.config), discovery_trial::other_plan(), c.seed + 1);
  if (!filtered) {
    return complain(filtered.error());
  }
  const sim::ConcealedPhysics concealed{{}, c.physics.laws};  // an effect beside them is not what they are to leave
  sim::ConcealedPhysics both = concealed;                     // the sum of the true laws and the negative of those told
  for (sim::Law law : told->laws) {
    law.coefficient = -law.coefficient;
    both.laws.push_back(law);
  }
  const auto with = filtered->response(concealed), without = filtered->response(both);
  if (!with || !without) {
    return complain(with ? without.error() : with.error());
  }
  fmt::print("{{\"left\": {:.6g}, \"sigmas\": {:.4g}}}\n",
             std::pow(without->sigmas / std::max(with->sigmas, 1e-9), 2.0), with->sigmas);
  return 0;
}

// "random:SECONDS" or the name of a file.
Expected<Schedule> schedule_called(const std::string& name, std::uint64_t seed) {
  const std::string random = "random:";
  if (!name.starts_with(random)) {
    return read_schedule(name);
  }
  const auto length = to_number(name.c_str() + random.size());
  return length ? discovery_trial::random_plan(seed, *length)
                : fail(ErrorKind::usage, fmt::format("{}: no length in seconds", name));
}

// The errors stay, the noise is another.
int write_again(Case c, const std::string& path, int time, const std::string& plan) {
  const auto schedule = schedule_called(plan, c.seed + 1000U * static_cast<std::uint64_t>(time));
  const auto errors = sim::true_sensor_errors(c.config, c.seed);
  if (!schedule || !errors) {
    return complain(schedule ? errors.error() : schedule.error());
  }
  discovery_trial::keep_errors(c.config, *errors);
  c.schedule = *schedule;
  c.seed += 1000000000000U * static_cast<std::uint64_t>(time);
  return write_record(c, path);
}

int run(std::span<char*> arguments) {
  const std::string verb = arguments.size() > 1 ? arguments[1] : "";
  if (verb == "key" && arguments.size() == 13) {
    return write_key(arguments.subspan(2));
  }
  if (verb == "draw" && arguments.size() == 14) {
    return draw(arguments.subspan(2));
  }
  const bool again = verb == "again" && arguments.size() == 7 && to_number(arguments[5]);
  const bool of_case = (verb == "record" || verb == "left" || verb == "possible") && arguments.size() == 5;
  if ((again || of_case) && to_number(arguments[3])) {
    const auto c = case_in(arguments[2], *to_number(arguments[3]));
    if (!c) {
      return complain(c.error());
    }
    if (again) {
      return write_again(*c, arguments[4], *to_number(arguments[5]), arguments[6]);
    }
    if (verb == "possible" && to_number(arguments[4])) {
      return print_possible(*c, *to_number(arguments[4]));
    }
    return verb == "record" ? write_record(*c, arguments[4]) : print_left(*c, arguments[4]);
  }
  fmt::print(
      stderr,
      "usage: selfcal_discovery_generate key SEED LAWS PAIRS PROCESSES CLEAN FOREIGN EFFECTS BESIDE DEEP MIXED FILE | "
      "draw SEED LAWS PAIRS PROCESSES CLEAN FOREIGN EFFECTS BESIDE DEEP MIXED NUMBER FILE | record KEY NUMBER FILE | "
      "again KEY "
      "NUMBER FILE K PLAN | possible KEY NUMBER COUNT | left KEY NUMBER LAWS.toml\n");
  return 2;
}

}  // namespace

int main(int count, char** values) {
  try {
    return run({values, static_cast<std::size_t>(count)});
  } catch (const std::exception& problem) {
    return complain({ErrorKind::bad_input, problem.what()});
  }
}
