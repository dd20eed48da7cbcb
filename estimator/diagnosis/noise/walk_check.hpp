// Does a bias that differs from dwell to dwell walk, or jump?
#pragma once

#include "estimator/diagnosis/regression/evidence.hpp"
#include "estimator/models/imu_data.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

// A walk goes on inside the dwells; what only jumps between them is none. True also where a walk of this rate would be
// too small to be seen there.
bool walks_inside_dwells(const ImuData& data, const NoiseModel& noise, const RandomWalk& walk);

}  // namespace selfcal::diagnosis
