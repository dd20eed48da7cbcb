// The report: one self-contained HTML file that opens from disk, with everything known about one calibration.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "estimator/passes/calibration.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::report {

// result_json() with its curves, and what the plots need besides: gimbal angles over time, Allan deviations.
nlohmann::ordered_json report_document(const CalibrationResult& result, const CalibrationOptions& options,
                                       const Recording& recording, const std::vector<std::string>& warnings);

// The page that shows `document`; it holds the document, the program and the plotting library, and asks no network.
std::string report_page(const nlohmann::ordered_json& document);

}  // namespace selfcal::report
