// Does a bias that differs from dwell to dwell change inside them too, or only jump between them?
#pragma once

#include "estimator/diagnosis/regression/bias_process.hpp"
#include "estimator/models/imu_data.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

// A walk or an instability goes on inside the dwells; what only jumps between them is neither. True also where one of this size would be
// too small to be seen there.
bool goes_on_inside_dwells(const ImuData& data, const NoiseModel& noise, const BiasProcess& process);

}  // namespace selfcal::diagnosis
