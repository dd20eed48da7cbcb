// The cases of a blind trial: each follows from the trial's seed and its own number alone.
#pragma once

#include <string>
#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "protocol/error.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/physics.hpp"
#include "tests/blind/response.hpp"

namespace selfcal::blind {

struct TrialSize {
  int clean = 300;
  int repeats = 1;  // of every effect at every strength; 0: none
};

// One case before anything is drawn.
struct Recipe {
  std::string stratum;  // clean, single, range, pair, outside, unlike, invisible, noise
  std::vector<std::string> effects;
  // Sigmas of the bound, each effect alone; `unlike`: that the best of its twins leaves; 0: typical size.
  double strength = 0.0;
};

// Strata are mixed, so that the first part of a trial is a small trial.
std::vector<Recipe> recipes(const TrialSize& size, std::uint64_t seed);

struct ConcealedEffect {
  sim::PhysicsEffect physics;
  Response response;  // of this effect alone, at its size; zero where a bound has no meaning (noise)
  // SI: bound of the 24 with all of the effect's coefficients and constants to be estimated; zero where not computed.
  ParameterVector augmented_sigma = ParameterVector::Zero();
  // Outside the catalogue: sigmas that the best of its likely twins (gyro drifts with attitude and time) leaves; below
  // 0 where not computed.
  double unlike_sigmas = -1.0;
};

struct Case {
  int number = 0;
  Recipe recipe;
  std::uint64_t seed = 0;
  sim::SimConfig config;
  Schedule schedule;
  std::vector<ConcealedEffect> effects;
};

// Draws site, attitude, schedule, noise, temperature and effects, and sizes the effects by their response. Where even
// the largest plausible size (40 times the typical) is weaker than asked for, that size is taken: the response says how
// strong it is.
[[nodiscard]] Expected<Case> draw_case(const Recipe& recipe, int number, std::uint64_t trial_seed);
// The same without its effects.
Case draw_installation(const Recipe& recipe, int number, std::uint64_t trial_seed);

}  // namespace selfcal::blind
