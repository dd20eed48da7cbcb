#include "estimator/diagnosis/effects/catalogue.hpp"

#include <algorithm>
#include <utility>

#include "estimator/diagnosis/effects/families.hpp"

namespace selfcal::diagnosis {

std::vector<EffectParameter> axis_parameters(const std::string& unit, double si_per_unit, double typical) {
  return {{"x", unit, si_per_unit, typical}, {"y", unit, si_per_unit, typical}, {"z", unit, si_per_unit, typical}};
}

std::vector<EffectParameter> matrix_parameters(const std::string& unit, double si_per_unit, double typical) {
  std::vector<EffectParameter> all;
  for (const char* name : {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"}) {
    all.push_back({name, unit, si_per_unit, typical});
  }
  return all;
}

void add_matrix(Columns columns, const Vector3& v) {
  for (Eigen::Index row = 0; row < 3; ++row) {
    columns.block<1, 3>(row, 3 * row) += v.transpose();
  }
}

std::vector<std::string> ids_of(const std::vector<const Effect*>& effects) {
  std::vector<std::string> ids;
  ids.reserve(effects.size());
  for (const Effect* effect : effects) {
    ids.push_back(effect->id);
  }
  return ids;
}

EffectConstant time_constant(std::span<const double> grid) {
  return {.kind = EffectConstant::Kind::grid, .grid = grid, .name = "tau", .unit = "s", .physics_key = "tau_s"};
}

const std::vector<Effect>& catalogue() {
  static const std::vector<Effect> all = [] {
    std::vector<Effect> effects;
    for (auto* family :
         {thermal_effects, accelerometer_effects, gyro_effects, mounting_effects, base_effects, after_turn_effects}) {
      for (Effect& effect : family()) {
        effects.push_back(std::move(effect));
      }
    }
    std::stable_sort(effects.begin(), effects.end(),
                     [](const Effect& a, const Effect& b) { return a.place < b.place; });
    return effects;
  }();
  return all;
}

}  // namespace selfcal::diagnosis
