// The effects that the diagnosis can name. To add one: a file in effects/, its line in `declare` and in the list.
#pragma once

#include <vector>

#include "estimator/diagnosis/effect.hpp"

namespace selfcal::diagnosis {

// All, the ones with fewer parameters before those that contain them.
const std::vector<Effect>& catalogue();

}  // namespace selfcal::diagnosis
