// Innovations of the calibration's filter, overlaid: their autocorrelation, their size minute by minute, their histogram. Private to
// this folder.
#pragma once

#include "tools/report/overlay.hpp"

namespace selfcal::report {

std::vector<OverlayCurve> overlay_innovations(const ImuData& recording, const CalibrationResult& of_recording,
                                              const ImuData& simulation, const CalibrationResult& of_simulation);

}  // namespace selfcal::report
