// What the page of one calibration shows.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/estimate/judged_result.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::report {

// result_json() with its curves, and what the plots need besides: gimbal angles over time, Allan deviations.
nlohmann::ordered_json calibration_document(const JudgedResult& judged, const CalibrationOptions& options,
                                            const Recording& recording, const std::vector<std::string>& warnings);

}  // namespace selfcal::report
