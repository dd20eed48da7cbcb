#include "tests/discovery/drawn.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"
#include "tests/blind/kinds.hpp"
#include "tests/blind/plan.hpp"
#include "tests/blind/response.hpp"

namespace selfcal::discovery_trial {
namespace {

using sim::Random;

constexpr double moored_share = 0.2;

template <std::size_t n>
std::string one_of(const std::array<const char*, n>& words, Random& random) {
  return words[static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(n) * (1.0 - 1e-12)))];
}
double log_uniform(Random& random, double low, double high) {
  return low * std::pow(high / low, random.uniform(0.0, 1.0));
}

// A quantity of the motion, sometimes squared or its size.
std::string quantity(Random& random) {
  static constexpr std::array<const char*, 14> some = {
      "fx", "fy", "fz", "wx", "wy", "wz", "wo", "wi", "t", "so", "sin(outer)", "cos(inner)", "cos(outer)", "si"};
  const std::string word = one_of(some, random);
  const double form = random.uniform(0.0, 1.0);
  return form < 0.7 ? word : (form < 0.85 ? "abs(" + word + ")" : word + "**2");
}

std::string kernel(Random& random) {
  const double form = random.uniform(0.0, 1.0);
  if (form < 0.4) {
    return fmt::format("exp(-since/{:.4g})", log_uniform(random, 8.0, 150.0));
  }
  if (form < 0.6) {
    return fmt::format("log(1+rest/{:.4g})*abs(so)", log_uniform(random, 2.0, 40.0));
  }
  if (form < 0.8) {
    return fmt::format("exp(-t/{:.4g})", log_uniform(random, 0.06, 0.5));
  }
  return fmt::format("sin(2*pi*t/{:.4g}+{:.4g})", log_uniform(random, 0.15, 1.5), random.uniform(-3.0, 3.0));
}

std::string within_grammar(Random& random) {
  const double form = random.uniform(0.0, 1.0);
  if (form < 0.35) {
    return quantity(random) + "*" + quantity(random);
  }
  if (form < 0.5) {
    return kernel(random);
  }
  if (form < 0.9) {
    return kernel(random) + "*" + quantity(random);
  }
  return quantity(random);
}

// Three quantities, or a kernel and two: forces, rates, the gimbal's angles and their harmonics, time, senses, the count of turns.
std::string deep_quantity(Random& random) {
  if (random.uniform(0.0, 1.0) < 0.75) {
    return quantity(random);
  }
  static constexpr std::array<const char*, 9> more = {"sin(2*outer)", "cos(2*outer)", "sin(2*inner)", "cos(2*inner)",
                                                      "sin(3*outer)", "cos(3*inner)", "sin(inner)",   "n",
                                                      "cos(3*outer)"};
  return one_of(more, random);
}

std::string product_of_three(Random& random) {
  const std::string two = deep_quantity(random) + "*" + deep_quantity(random);
  return (random.uniform(0.0, 1.0) < 0.6 ? deep_quantity(random) : kernel(random)) + "*" + two;
}

// Forms that the search had not when the trial was made. Since then it has quotients of one quantity by another, waves over the count of
// turns.
std::string beyond_first_grammar(Random& random) {
  const double form = random.uniform(0.0, 1.0);
  if (form < 0.2) {
    return fmt::format("exp(-sqrt(since/{:.4g}))", log_uniform(random, 3.0, 40.0));
  }
  if (form < 0.4) {
    return fmt::format("tanh({}*{:.3g})", one_of(std::array{"fx+fy", "fy-fz", "wx*fy"}, random),
                       log_uniform(random, 2.0, 8.0));
  }
  if (form < 0.6) {
    return fmt::format("sqrt(abs({}))*{}", one_of(std::array{"fx*fy", "fx+fz", "wx"}, random), quantity(random));
  }
  if (form < 0.8) {
    return fmt::format("{}/(1.2+{})", one_of(std::array{"fx", "fy", "so", "fz"}, random),
                       one_of(std::array{"sin(outer)", "fy", "cos(inner)"}, random));
  }
  return fmt::format("sin({:.3g}*n)*{}", random.uniform(0.7, 2.6), one_of(std::array{"fx", "1", "fz"}, random));
}

// Forms that the search has not: harmonics between the whole ones, thresholds, exponentials of a force, a quotient of two forces by a
// third, two kernels in one.
std::string beyond_any_grammar(Random& random) {
  const double form = random.uniform(0.0, 1.0);
  const std::string angle = one_of(std::array{"outer", "inner"}, random);
  if (form < 0.2) {
    return fmt::format("sin({:.3g}*{}+{:.3g})", random.uniform(1.3, 1.7), angle, random.uniform(-3.0, 3.0));
  }
  if (form < 0.4) {
    return fmt::format("(1+sign(sin({})-{:.3g}))*{}", angle, random.uniform(0.2, 0.8), quantity(random));
  }
  if (form < 0.6) {
    return fmt::format("exp({:.3g}*{})", random.uniform(1.5, 4.0),
                       one_of(std::array{"fx", "fy", "fz", "fx*fy"}, random));
  }
  if (form < 0.8) {
    return fmt::format("{}/({:.3g}+fz**2)", one_of(std::array{"fx*fy", "fx*so", "fy*si", "wx*wy"}, random),
                       log_uniform(random, 0.05, 0.3));
  }
  return fmt::format("exp(-since/{:.4g})*exp(-t/{:.4g})", log_uniform(random, 8.0, 150.0),
                     log_uniform(random, 0.06, 0.3));
}

std::string beyond_grammar(Random& random) {
  constexpr double first_share = 0.6;
  return random.uniform(0.0, 1.0) < first_share ? beyond_first_grammar(random) : beyond_any_grammar(random);
}

sim::Law draw_law(const std::string& kind, Random& random) {
  sim::Law law;
  law.axis = static_cast<int>(random.uniform(0.0, 5.9999));
  law.expression = kind == "foreign" ? beyond_grammar(random)
                   : kind == "deep"  ? product_of_three(random)
                                     : within_grammar(random);
  law.coefficient = law.axis < 3 ? 0.01 * units::degree_per_hour : 10.0 * units::micro_g;
  if (kind == "process") {
    const bool jump = random.uniform(0.0, 1.0) < 0.5;
    law.process = jump ? sim::LawProcess::jump_per_turn : sim::LawProcess::random_walk;
    law.expression.clear();
    law.coefficient /= jump ? 1.0 : std::sqrt(units::hour);
  }
  return law;
}

sim::SimConfig draw_installation(Random& random) {
  sim::SimConfig config;
  config.sample_rate_hz = 50.0;
  config.parameter_set = "random";
  config.latitude_deg = random.uniform(20.0, 60.0);
  const bool tilted = random.uniform(0.0, 1.0) < 0.75;
  config.roll_deg = tilted ? random.uniform(-8.0, 8.0) : 0.0;
  config.pitch_deg = tilted ? random.uniform(3.0, 9.0) : 0.0;
  config.heading_deg = random.uniform(0.0, 360.0);
  config.gyro_arw_deg_per_sqrt_h = 0.001;
  config.accel_vrw_ug_per_sqrt_hz = 5.0;
  config.temperature.recorded = random.uniform(0.0, 1.0) < 0.5;
  if (random.uniform(0.0, 1.0) < moored_share) {
    config.base_motion = sim::moored_base_motion();
  }
  return config;
}

// The effects of the catalogue as the blind trial draws them.
Expected<Case> draw_effect_case(const Recipe& recipe, int number, std::uint64_t seed) {
  const auto drawn =
      blind::draw_case({recipe.effects.size() == 1 ? "single" : "pair", recipe.effects, recipe.strength}, number, seed);
  if (!drawn) {
    return tl::unexpected(drawn.error());
  }
  Case c{number, recipe.kind, recipe.strength, drawn->seed, drawn->config, drawn->schedule, {}, {}};
  for (const blind::ConcealedEffect& effect : drawn->effects) {
    c.physics.effects.push_back(effect.physics);
    c.effect_sigmas.push_back(effect.response.sigmas);
  }
  return c;
}

// Draws laws of the kind, each as strong as the case says, until there are so many.
Expected<void> add_laws(Case& c, std::size_t count, const blind::Filtered& filtered, Random& random) {
  for (int tries = 0; c.physics.laws.size() < count; ++tries) {
    constexpr int most_tries = 200;
    if (tries == most_tries) {
      return fail(ErrorKind::internal, fmt::format("case {}: no law of {} sigma was drawn", c.number, c.strength));
    }
    sim::Law law = draw_law(c.kind, random);
    const auto response = filtered.response({{}, {law}});
    // What takes more than these to reach its strength is nothing that a sensor does.
    const double largest = law.axis < 3 ? 5.0 * units::degree_per_hour : 3000.0 * units::micro_g;
    if (!response || !(response->sigmas > 0.0)) {
      continue;
    }
    law.coefficient *= c.strength / response->sigmas;
    const double in_time = law.process == sim::LawProcess::random_walk ? std::sqrt(units::hour) : 1.0;
    if (law.coefficient * in_time < largest) {
      c.physics.laws.push_back(law);
    }
  }
  return {};
}

// The strength of a law is that on a base which stands still.
Expected<blind::Filtered> still_filter(const Case& c) {
  sim::SimConfig still = c.config;
  still.base_motion = {};
  return blind::Filtered::make(still, c.schedule, c.seed);
}

Expected<ParameterVector> bound_of(const blind::Filtered& filtered, const std::vector<sim::Law>& laws) {
  std::vector<blind::Column> columns;
  for (const sim::Law& law : laws) {
    blind::Column column;
    column.plus.laws = {law};
    column.prior = 1e6;  // times its size: nothing is known beforehand
    columns.push_back(std::move(column));
  }
  return filtered.augmented_sigma(columns);
}

}  // namespace

std::vector<Recipe> recipes(const Counts& counts, std::uint64_t seed) {
  std::vector<Recipe> all;
  const auto add = [&all](const char* kind, double strength, int count) {
    for (int k = 0; k < count; ++k) {
      all.push_back({kind, strength, {}});
    }
  };
  constexpr std::array<double, 3> strengths = {10.0, 30.0, 100.0};
  for (const double strength : strengths) {
    add("law", strength, counts.laws);
  }
  add("pair", 30.0, counts.pairs);
  add("process", 30.0, counts.processes);
  add("clean", 0.0, counts.clean);
  add("foreign", 30.0, counts.foreign);
  std::vector<std::string> catalogue;
  for (const blind::Kind& kind : blind::kinds()) {
    if (kind.group == blind::KindGroup::catalogue) {
      catalogue.emplace_back(kind.id);
    }
  }
  for (int k = 0; k < counts.effects; ++k) {
    const auto n = static_cast<std::size_t>(k);
    all.push_back({"effect", strengths[n / catalogue.size() % strengths.size()], {catalogue[n % catalogue.size()]}});
  }
  for (int k = 0; k < counts.beside; ++k) {
    all.push_back({"beside", 30.0, {catalogue[static_cast<std::size_t>(k) % catalogue.size()]}});
  }
  add("deep", 30.0, counts.deep);
  constexpr std::uint64_t stream = 13;
  Random random(seed, stream);
  for (int k = 0; k < counts.mixed; ++k) {
    const auto pick = [&] {
      return static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(catalogue.size()) - 1e-9));
    };
    const std::size_t first = pick();
    std::size_t second = pick();
    while (second == first) {
      second = pick();
    }
    all.push_back({"mixed", 30.0, {catalogue[first], catalogue[second]}});
  }
  return all;
}

Expected<Case> draw_case(const Recipe& recipe, int number, std::uint64_t seed) {
  constexpr std::uint64_t streams_per_seed = 100000;
  Random random(seed, streams_per_seed + static_cast<std::uint64_t>(number));
  if (!recipe.effects.empty()) {
    auto c = draw_effect_case(recipe, number, seed);
    if (!c || c->kind == "effect") {
      return c;
    }
    const auto filtered = still_filter(*c);
    const auto added = filtered ? add_laws(*c, 1, *filtered, random) : tl::unexpected(filtered.error());
    return added ? c : tl::unexpected(added.error());
  }
  Case c;
  c.number = number;
  c.kind = recipe.kind;
  c.strength = recipe.strength;
  c.seed = seed * streams_per_seed + static_cast<std::uint64_t>(number);
  c.config = draw_installation(random);
  c.schedule = *named_schedule("horizontal");
  const auto filtered = still_filter(c);
  if (!filtered) {
    return tl::unexpected(filtered.error());
  }
  const std::size_t count = c.kind == "clean" ? 0 : (c.kind == "pair" ? 2 : 1);
  if (const auto added = add_laws(c, count, *filtered, random); !added) {
    return tl::unexpected(added.error());
  }
  if (c.kind == "law" || c.kind == "pair" || c.kind == "deep") {
    const auto bound = bound_of(*filtered, c.physics.laws);
    if (!bound) {
      return tl::unexpected(bound.error());
    }
    c.bound = *bound;
  }
  return c;
}

std::vector<sim::Law> possible_laws(const Case& drawn, std::size_t count) {
  constexpr std::uint64_t stream = 11;
  Random random(drawn.seed, stream);
  std::vector<sim::Law> all;
  for (std::size_t k = 0; k < count; ++k) {
    all.push_back(draw_law(drawn.kind, random));
  }
  all.insert(all.end(), drawn.physics.laws.begin(), drawn.physics.laws.end());
  return all;
}

Schedule other_plan() {
  Schedule plan;
  constexpr std::array<std::array<double, 2>, 20> positions = {
      {{45, 45},   {135, 45}, {225, 45},  {315, 45},  {315, 135}, {225, 135}, {135, 135},
       {45, 135},  {45, 225}, {135, 225}, {225, 225}, {315, 225}, {315, 315}, {225, 315},
       {135, 315}, {45, 315}, {45, 225},  {135, 135}, {225, 45},  {135, 45}}};
  for (const auto& [outer, inner] : positions) {
    plan.positions.push_back({outer, inner});
    plan.dwell_s.push_back(100.0);
  }
  plan.rotation_s = 8.0;
  return plan;
}

sim::SimConfig other_installation(const sim::SimConfig& config) {
  sim::SimConfig other = config;
  other.roll_deg = -9.0;
  other.pitch_deg = 14.0;
  other.base_motion = {};
  other.heading_deg = std::fmod(config.heading_deg + 77.0, 360.0);
  return other;
}

Expected<Schedule> random_plan(std::uint64_t seed, double length_s) {
  constexpr std::uint64_t stream = 7;
  constexpr double step_deg = 45.0;
  Random random(seed, stream);
  Schedule plan;
  plan.rotation_s = 5.0;
  double outer = 0.0, inner = 0.0, spent_s = 0.0;
  while (spent_s < length_s) {
    plan.positions.push_back({outer, inner});
    plan.dwell_s.push_back(std::min(random.uniform(60.0, 150.0), std::max(1.0, length_s - spent_s)));
    spent_s += plan.dwell_s.back() + plan.rotation_s;
    const double before_outer = outer, before_inner = inner;
    while (outer == before_outer && inner == before_inner) {
      outer = std::clamp(before_outer + step_deg * std::round(random.uniform(-2.49, 2.49)), -360.0, 360.0);
      inner = std::clamp(before_inner + step_deg * std::round(random.uniform(-2.49, 2.49)), -360.0, 360.0);
    }
  }
  return plan;
}

void keep_errors(sim::SimConfig& config, const sim::SensorErrors& errors) {
  for (std::size_t k = 0; k < sensor_parameters.size(); ++k) {
    config.explicit_parameters[k] = errors[k] / sensor_parameters[k].si_per_unit;
  }
}

}  // namespace selfcal::discovery_trial
