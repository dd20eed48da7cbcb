// One case of the discovery trial, drawn from its number: the installation, the plan and what is concealed.
//
// The grammar of the laws is this file's own: it knows no function of the search, and holds forms that the search has not.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "estimator/models/sensor_model.hpp"
#include "protocol/error.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/physics.hpp"
#include "sim_ins/random.hpp"

namespace selfcal::discovery_trial {

struct Case {
  int number = 0;
  // clean, law, pair, process, foreign (a law of forms that the search has not), effect (of the catalogue), beside (a law
  // within the search's forms beside an effect of the catalogue, both of the same strength), mixed (the same beside two effects), deep (a
  // product of three quantities or of a kernel and two)
  std::string kind;
  double strength = 0.0;  // sigma, of each law
  std::uint64_t seed = 0;
  sim::SimConfig config;
  Schedule schedule;
  sim::ConcealedPhysics physics;
  // Of each effect of `physics`, alone and the base still: what it reaches at the largest size that it may have, where that is less than `strength`.
  std::vector<double> effect_sigmas;
  // SI: bound of the 24 of a filter that also estimates the coefficients of the laws, the base still. Zero but for laws, pairs and products of three.
  ParameterVector bound = ParameterVector::Zero();
};

struct Counts {
  int laws = 40;  // of each strength
  int pairs = 40, processes = 40, clean = 400, foreign = 40, effects = 120, beside = 40, deep = 40, mixed = 40;
};

// Kinds in the order of the trial, with strength; `repeats` of each.
struct Recipe {
  std::string kind;
  double strength = 0.0;
  std::vector<std::string> effects;
};
std::vector<Recipe> recipes(const Counts& counts, std::uint64_t seed);

[[nodiscard]] Expected<Case> draw_case(const Recipe& recipe, int number, std::uint64_t seed);

// Laws as this case's was drawn, each with its axis, the case's own at the end: any of them could have been concealed.
std::vector<sim::Law> possible_laws(const Case& drawn, std::size_t count);

// The plan that no case is recorded on: 20 positions at 45 and 135 degrees, the base at another attitude.
Schedule other_plan();
sim::SimConfig other_installation(const sim::SimConfig& config);
// A rotation that nobody designed: positions 45 degrees apart, at random.
Expected<Schedule> random_plan(std::uint64_t seed, double length_s);
// These errors (SI) whatever the seed: the same unit recorded again.
void keep_errors(sim::SimConfig& config, const sim::SensorErrors& errors);

}  // namespace selfcal::discovery_trial
