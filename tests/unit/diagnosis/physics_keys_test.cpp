// Estimator and simulation name an effect's parameters alike, in the same units: a physics file is written by a loop.
#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "sim_ins/physics.hpp"

namespace selfcal {
namespace {

const sim::EffectParameter* key_of(const std::string& id, const std::string& key) {
  const auto effect = std::ranges::find(sim::physics_effects(), id, &sim::EffectDescription::id);
  if (effect == sim::physics_effects().end()) {
    return nullptr;
  }
  const auto found = std::ranges::find(effect->parameters, key, &sim::EffectParameter::name);
  return found == effect->parameters.end() ? nullptr : &*found;
}

// Motion of the base stands along the vehicle there and along north, up, east here; a wrong site is no physics.
TEST(PhysicsKeys, AreThoseOfTheSimulation) {
  for (const diagnosis::Effect& e : diagnosis::catalogue()) {
    if (e.displacement != nullptr || e.data_fault != nullptr) {
      continue;
    }
    for (const diagnosis::EffectParameter& p : e.parameters) {
      const sim::EffectParameter* key = key_of(e.id, e.physics_prefix + p.name);
      ASSERT_NE(key, nullptr) << e.id << " " << e.physics_prefix << p.name;
      EXPECT_EQ(key->unit, p.unit) << e.id << " " << p.name;
      EXPECT_NEAR(key->si_per_unit / p.si_per_unit, 1.0, 1e-12) << e.id << " " << p.name;
    }
    if (e.constant.kind == diagnosis::EffectConstant::Kind::grid) {
      const sim::EffectParameter* key = key_of(e.id, std::string(e.constant.physics_key));
      ASSERT_NE(key, nullptr) << e.id << " " << e.constant.physics_key;
      EXPECT_NEAR(key->si_per_unit * e.constant.physics_per_unit, 1.0, 1e-12) << e.id;
    }
  }
}

}  // namespace
}  // namespace selfcal
