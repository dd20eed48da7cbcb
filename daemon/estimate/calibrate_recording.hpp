// From a recording to the answer: shared by daemon and command line, so that both give the same numbers.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/diagnosis/data/set_aside.hpp"
#include "estimator/passes/calibration.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// The estimator's view of a recording, which must outlive it. `first_temperature` gets the first channel where the
// recording has several (the view needs it contiguous) and must outlive the view too.
ImuData imu_view(const Recording& recording, std::vector<double>& first_temperature);

// Runs calibrate() and fills elapsed_s. The error (bad_input) names why no result can be computed; a bad result is no error:
// gate.hpp judges it. The recording must have passed check_recording. `aside`: its sound part, in the place of all of it.
Expected<CalibrationResult> calibrate_recording(const Recording& recording, const CalibrationOptions& options,
                                                const std::function<void(const CalibrationProgress&)>& progress = {},
                                                const std::stop_token& stop = {},
                                                const diagnosis::SetAside* aside = nullptr);

}  // namespace selfcal
