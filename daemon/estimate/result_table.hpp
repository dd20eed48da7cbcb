// The answer for people: verdict, cause and next step, a table of the 24 with sigma and tolerance, then the passes.
#pragma once

#include <string>

#include "daemon/estimate/judged_result.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// Broken to `columns`; 0: not broken. Where the diagnosis names what was left out, the corrected values stand beside.
std::string result_table(const JudgedResult& judged, const CalibrationOptions& options, const Recording& recording,
                         bool colour, int columns = 0);

}  // namespace selfcal
