// What a run measured, as the database keeps it, and what the unit's past says to it.
#pragma once

#include <string>
#include <vector>

#include "daemon/estimate/gate.hpp"
#include "daemon/store/run_store.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal {

RunStore::Parameters measured_parameters(const CalibrationResult& result);

// Of values that depart from the past of this unit, or come near a limit. `utc`: when they were measured.
std::vector<std::string> history_warnings(const RunStore& store, const RunRecord& run, const std::string& utc,
                                          const RunStore::Parameters& parameters, const Limits& limits);

}  // namespace selfcal
