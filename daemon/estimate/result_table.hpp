// The answer for people: a table of the 24 with sigma and tolerance, then passes and verdict.
#pragma once

#include <string>

#include "estimator/passes/calibration.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

std::string result_table(const CalibrationResult& result, const CalibrationOptions& options, const Recording& recording,
                         bool colour);

}  // namespace selfcal
