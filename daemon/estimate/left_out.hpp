// What of a recording was left out of an answer, and what that costs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/passes/calibration.hpp"

namespace selfcal {

// Empty where nothing was.
std::string left_out_text(const CalibrationResult& result);
nlohmann::ordered_json left_out_json(const CalibrationResult& result);

}  // namespace selfcal
