// Monte Carlo: what the errors of many calibrations are against what they claim.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "tools/batch/batch_folder.hpp"

namespace selfcal::batch {

// Of the needs of `task`, pairs of a simulation and its estimate: for each of the 24 the rms of the error, the rms of sigma,
// both in the parameter's unit, and `ratio`, the rms of error over sigma: 1 where sigma is true. A calibration that did
// not determine the parameter does not count in it; null where none did.
Expected<nlohmann::ordered_json> calibration_statistics(const BatchFolder& folder, const Task& task);

}  // namespace selfcal::batch
