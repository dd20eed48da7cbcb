// What a recording left open, for people: at most five lines of at most 100 characters.
#pragma once

#include <string>

#include "estimator/passes/calibration.hpp"

namespace selfcal {

// Few directions: a line each, with the parameters that move together, and what would fix the worst. Many (a recording
// that hardly turns): which parameters are open, the worst direction, what would fix it. Empty where all are determined.
std::string undetermined_text(const CalibrationResult& result);

}  // namespace selfcal
