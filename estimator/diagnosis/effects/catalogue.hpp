// The effects that the diagnosis can name. To add one: a row and an equation in its family, effects/.
#pragma once

#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"

namespace selfcal::diagnosis {

// All, in the order of their `place`. An effect is known by its address here.
const std::vector<Effect>& catalogue();

}  // namespace selfcal::diagnosis
