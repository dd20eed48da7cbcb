#include "tests/blind/plan.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"
#include "sim_ins/random.hpp"
#include "tests/blind/kinds.hpp"

namespace selfcal::blind {
namespace {

constexpr double largest_size = 40.0;  // typical sizes
const std::vector<double> strengths = {0.3, 1.0, 3.0, 6.0, 10.0};
// What can be seen well has no size of its own: every logarithm is as likely.
constexpr double range_from = 6.0, range_to = 100.0;
constexpr int range_cases = 2;  // of every effect

std::vector<std::string> ids_of(KindGroup group) {
  std::vector<std::string> ids;
  for (const Kind& kind : kinds()) {
    if (kind.group == group) {
      ids.emplace_back(kind.id);
    }
  }
  return ids;
}

double log_uniform(sim::Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

void install(Case& c, sim::Random& random) {
  sim::SimConfig& s = c.config;
  s.serial = "BLIND-" + std::to_string(c.number);
  s.parameter_set = "random";
  s.sample_rate_hz = random.uniform() < 0.75 ? 50.0 : 100.0;
  s.latitude_deg = random.uniform(-60.0, 60.0);
  s.longitude_deg = random.uniform(-180.0, 180.0);
  s.height_m = random.uniform(0.0, 500.0);
  s.roll_deg = random.uniform(-3.0, 3.0);
  s.pitch_deg = random.uniform(-3.0, 3.0);
  s.heading_deg = random.uniform(0.0, 360.0);
  s.gyro_arw_deg_per_sqrt_h = log_uniform(random, 0.0005, 0.003);
  s.accel_vrw_ug_per_sqrt_hz = log_uniform(random, 2.0, 15.0);
  s.temperature.recorded = random.uniform() < 0.5;
  s.temperature.warm_up_c = random.uniform(3.0, 12.0);
  s.temperature.warm_up_tau_s = random.uniform(300.0, 1500.0);
  const char* name = random.uniform() < 0.75 ? "horizontal" : "table2";
  c.schedule = *named_schedule(name, std::round(random.uniform(45.0, 90.0)), std::round(random.uniform(5.0, 8.0)));
  if (c.recipe.stratum == "clean" && random.uniform() < 0.1) {
    s.base_motion = sim::moored_base_motion();
  }
}

// Noise and data are sized by their own scale: there is no bound of a mean.
sim::PhysicsEffect draw_noise(const Kind& kind, const sim::SimConfig& config, sim::Random& random) {
  sim::PhysicsEffect effect = draw_effect(kind, config, random);
  const auto set_axes = [&](double value) { std::fill_n(effect.values.begin(), 3, value); };
  // A density `times` that of the configuration: what is added in quadrature.
  const double times = random.uniform(1.5, 3.0);
  const double added = std::sqrt(times * times - 1.0);
  if (kind.id == "gyro_noise_level") {
    set_axes(added * config.gyro_arw_deg_per_sqrt_h);
  } else if (kind.id == "accel_noise_level") {
    set_axes(added * config.accel_vrw_ug_per_sqrt_hz);
  } else {
    return effect;
  }
  for (const auto& d : sim::physics_effects()) {
    for (std::size_t k = 0; d.id == kind.id && k < 3; ++k) {
      effect.values[k] *= d.parameters[k].si_per_unit;
    }
  }
  return effect;
}

// Mean over the recording: what the diagnosis refers the 24 to where temperature is recorded. Else a warm-up begins at
// the start's.
double reference_temperature(const Case& c) {
  const sim::TemperatureConfig& t = c.config.temperature;
  if (!t.recorded) {
    return t.start_c;
  }
  const double duration = c.schedule.duration_s();
  return t.start_c + t.warm_up_c * (1.0 + t.warm_up_tau_s / duration * std::expm1(-duration / t.warm_up_tau_s)) +
         0.5 * t.ramp_c_per_h / units::hour * duration;
}

// Where the base is level a drift with the sine of the inner angle is a g-sensitivity; and most slow drifts are alike.
Expected<double> unlike_twins(const Filtered& filtered, const sim::SimConfig& config,
                              const sim::PhysicsEffect& concealed) {
  sim::Random random(1, 1);  // of the columns only their span counts
  double least = HUGE_VAL;
  for (const char* id :
       {"gyro_g_sensitivity", "gyro_magnetic_sensitivity", "gyro_drift_ramp", "gyro_temperature", "gyro_temperature"}) {
    const Kind& kind = kind_called(id);
    const sim::PhysicsEffect drawn = draw_effect(kind, config, random);
    const auto left = filtered.unlike({{concealed}}, columns_of(kind, config, drawn, 1.0));
    if (!left) {
      return tl::unexpected(left.error());
    }
    least = std::min(least, *left);
  }
  return least;
}

Expected<ConcealedEffect> sized(const Case& c, const Kind& kind, sim::Random& random) {
  const auto filtered = Filtered::make(c.config, c.schedule, c.seed);
  if (!filtered) {
    return tl::unexpected(filtered.error());
  }
  const bool by_likeness = c.recipe.stratum == "unlike";
  ConcealedEffect best;
  double size = 0.0, strongest = -1.0;
  // A direction that cannot be seen is drawn again, a few times.
  for (int attempt = 0; attempt < 4; ++attempt) {
    sim::PhysicsEffect unit = draw_effect(kind, c.config, random);
    set_reference_temperature(unit, reference_temperature(c));
    const auto response = filtered->response({{unit}});
    if (!response) {
      return tl::unexpected(response.error());
    }
    double strength = response->sigmas;  // of the unit
    if (by_likeness) {
      const auto left = unlike_twins(*filtered, c.config, unit);
      if (!left) {
        return tl::unexpected(left.error());
      }
      strength = *left;
    }
    const double wanted = c.recipe.strength > 0.0 ? c.recipe.strength / strength : 1.0;
    const double factor = std::min(wanted, largest_size);
    if (factor * strength > strongest) {
      strongest = factor * strength;
      best = {scaled(kind, unit, factor), *response, ParameterVector::Zero(), by_likeness ? strongest : -1.0};
      best.response.sigmas *= factor;
      best.response.shift *= factor;
      size = factor;
    }
    if (factor == wanted) {
      break;
    }
  }
  if (c.recipe.effects.size() == 1 && kind.group == KindGroup::catalogue && c.recipe.strength >= 6.0) {
    const auto sigma = filtered->augmented_sigma(columns_of(kind, c.config, best.physics, size));
    if (!sigma) {
      return tl::unexpected(sigma.error());
    }
    best.augmented_sigma = *sigma;
  }
  if (c.recipe.stratum == "outside") {
    const auto left = unlike_twins(*filtered, c.config, best.physics);
    if (!left) {
      return tl::unexpected(left.error());
    }
    best.unlike_sigmas = *left;
  }
  return best;
}

}  // namespace

std::vector<Recipe> recipes(const TrialSize& size, std::uint64_t seed) {
  std::vector<Recipe> all(static_cast<std::size_t>(std::max(0, size.clean)), Recipe{"clean", {}, 0.0});
  const std::vector<std::string> catalogue = ids_of(KindGroup::catalogue);
  sim::Random random(seed, 1);
  for (int r = 0; r < size.repeats; ++r) {
    for (const std::string& id : catalogue) {
      for (const double strength : strengths) {
        all.push_back({"single", {id}, strength});
      }
      for (int k = 0; k < range_cases; ++k) {
        all.push_back({"range", {id}, log_uniform(random, range_from, range_to)});
      }
      const auto other = static_cast<std::size_t>(random.uniform() * static_cast<double>(catalogue.size()));
      if (catalogue[other] != id) {
        all.push_back({"pair", {id, catalogue[other]}, 20.0});
      }
    }
    for (const std::string& id : ids_of(KindGroup::outside)) {
      for (const double strength : {6.0, 10.0, 30.0, 100.0}) {
        all.push_back({"outside", {id}, strength});
        all.push_back({"unlike", {id}, strength});
      }
    }
    for (const std::string& id : ids_of(KindGroup::invisible)) {
      all.push_back({"invisible", {id}, 0.0});
    }
    for (const std::string& id : ids_of(KindGroup::noise)) {
      all.push_back({"noise", {id}, 0.0});
    }
  }
  for (std::size_t k = all.size(); k > 1; --k) {  // Fisher and Yates
    std::swap(all[k - 1], all[static_cast<std::size_t>(random.uniform() * static_cast<double>(k))]);
  }
  return all;
}

namespace {

Case begun(const Recipe& recipe, int number, sim::Random& random) {
  Case c;
  c.number = number;
  c.recipe = recipe;
  c.seed = random.bits() >> 12;  // exact in JSON
  install(c, random);
  return c;
}

sim::Random stream(int number, std::uint64_t trial_seed) {
  return {trial_seed, 1000 + static_cast<std::uint64_t>(number)};
}

}  // namespace

Case draw_installation(const Recipe& recipe, int number, std::uint64_t trial_seed) {
  sim::Random random = stream(number, trial_seed);
  return begun(recipe, number, random);
}

Expected<Case> draw_case(const Recipe& recipe, int number, std::uint64_t trial_seed) {
  sim::Random random = stream(number, trial_seed);
  Case c = begun(recipe, number, random);
  for (const std::string& id : recipe.effects) {
    const Kind& kind = kind_called(id);
    if (kind.group == KindGroup::noise) {
      c.effects.push_back({draw_noise(kind, c.config, random), {}, ParameterVector::Zero(), -1.0});
      continue;
    }
    auto effect = sized(c, kind, random);
    if (!effect) {
      return tl::unexpected(effect.error());
    }
    c.effects.push_back(*effect);
  }
  return c;
}

}  // namespace selfcal::blind
