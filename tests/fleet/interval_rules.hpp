// Rules by which a unit's next calibration is set, tried on units that age by their own law (drawn_fleet.hpp).
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/fleet/fleet_model.hpp"
#include "tests/fleet/drawn_fleet.hpp"

namespace selfcal::fleet {

struct Rule {
  const char* name;
  int calibrations = 0, intervals = 0, left = 0;  // left: its limits within the interval
};

// So many years of each unit by one rule, looked at every two weeks; the truth is the same for each rule. `limit` of the change in
// sigmas of a calibration. which: 0 a fixed year, 1 the staircase of ILAC-G24, 2 by the forecast and its `risk`, 3 the control
// chart of ILAC-G24. Counts are added to `rule`.
void live(int units, double years, const Nature& nature, const std::vector<TypeModel>& models, double limit,
          double risk, std::uint64_t seed, Rule& rule, int which);

}  // namespace selfcal::fleet
