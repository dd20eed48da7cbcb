// Densities, quanta and lines against what the simulation assumes.
#pragma once

#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::diagnosis {

// `fitted`: the noise of the filter; `log_threshold`: of one p, corrected for axes and frequencies. None from less than
// enough_noise_pieces pieces.
std::vector<Finding> noise_findings(const CalibrationResult& calibration, const NoiseModel& fitted,
                                    const NoiseCheck& noise, const AssumedNoise& assumed, double log_threshold);

}  // namespace selfcal::diagnosis
