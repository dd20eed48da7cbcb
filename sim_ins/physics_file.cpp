#include <fmt/format.h>

#include <limits>

#include "sim_ins/physics.hpp"
#include "sim_ins/toml_reader.hpp"

namespace selfcal::sim {
namespace {

void read_effect(TomlTable& table, ConcealedPhysics& physics) {
  PhysicsEffect effect;
  table.text("id", effect.id);
  const EffectDescription* known = nullptr;
  for (const EffectDescription& description : physics_effects()) {
    known = description.id == effect.id ? &description : known;
  }
  if (known == nullptr) {
    table.refuse("id", effect.id.empty() ? "missing" : fmt::format("no effect is called {}", effect.id));
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

}  // namespace

Expected<ConcealedPhysics> parse_physics(const std::string& text, const std::string& name) {
  ConcealedPhysics physics;
  const auto read = read_toml(text, name, [&](TomlTable& root) {
    root.tables("effect", [&](TomlTable& table) { read_effect(table, physics); });
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
