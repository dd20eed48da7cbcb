// What the blind trial conceals: the effects, which of their numbers are drawn, and from where.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "sim_ins/config.hpp"
#include "sim_ins/physics.hpp"
#include "sim_ins/random.hpp"
#include "tests/blind/response.hpp"

namespace selfcal::blind {

enum class KindGroup { catalogue, outside, invisible, noise };

// Drawn from [low, high], on a logarithmic scale.
struct DrawnConstant {
  std::string_view name;
  double low = 0.0, high = 0.0;  // in the unit of the physics file
};

struct Kind {
  std::string_view id;
  KindGroup group = KindGroup::catalogue;
  std::vector<std::string_view> components;  // those that may differ from zero
  double typical = 0.0;                      // of a component, in the unit of the physics file
  std::vector<DrawnConstant> constants;
  // Components to take where the recording has no temperature channel; empty: the same.
  std::vector<std::string_view> without_temperature;
  double typical_without_temperature = 0.0;
};

std::span<const Kind> kinds();
const Kind& kind_called(std::string_view id);

// A direction in the space of the kind's components at typical size, and its constants: SI, in the order of
// sim::physics_effects(). One component alone as often as all of them at once.
sim::PhysicsEffect draw_effect(const Kind& kind, const sim::SimConfig& config, sim::Random& random);
// The components times a factor; constants stay.
sim::PhysicsEffect scaled(const Kind& kind, const sim::PhysicsEffect& effect, double factor);
// The temperature from which thermal effects count; others are left as they are.
void set_reference_temperature(sim::PhysicsEffect& effect, double celsius);

// What someone who knows the effect, but neither direction nor constants, has to estimate: one column per component at
// its typical size, one per constant for its logarithm, linearised about the effect.
std::vector<Column> columns_of(const Kind& kind, const sim::SimConfig& config, const sim::PhysicsEffect& effect,
                               double size);

}  // namespace selfcal::blind
