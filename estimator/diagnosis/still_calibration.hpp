// The 24 alone, as every diagnosis starts from them.
#pragma once

#include "estimator/passes/calibration.hpp"

namespace selfcal::diagnosis {

// Calibration in which a still base's position noise is not widened by what the model leaves out (it stands to
// micrometres), and in which densities that make the innovations far too small are taken back. Noise fitted to the drift
// (passes/noise_fit.hpp) stays only where nothing turned.
CalibrationOutcome calibrate_still(const ImuData& data, CalibrationOptions options, const std::stop_token& stop = {});

// Whether the sensors turned.
bool turned(const ImuData& data);

// A forward pass about the calibrated recording; `data` must outlive it.
PassInput forward_pass(const ImuData& data, const CalibrationResult& calibration);

}  // namespace selfcal::diagnosis
