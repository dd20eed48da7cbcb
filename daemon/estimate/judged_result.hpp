// A calibration with its judgement: the gate's answer, the cause of an inconsistency, the summary.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "daemon/estimate/gate.hpp"
#include "daemon/estimate/summary.hpp"
#include "estimator/diagnosis/data/set_aside.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/passes/calibration.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

struct JudgedResult {
  CalibrationResult result;
  std::optional<diagnosis::Diagnosis> diagnosis;  // of the same recording, where one was made
  std::optional<discovery::Discovery> beyond;     // where the catalogue explains nothing
  Gate gate;
  Summary summary;
};

// Judges what has been calibrated already.
JudgedResult judged(CalibrationResult result, const ParameterVector& tolerance, const Limits& limits,
                    const Subject& subject, std::optional<diagnosis::Diagnosis> diagnosis = std::nullopt,
                    std::optional<discovery::Discovery> beyond = std::nullopt);

struct JudgedProgress {
  std::function<void(const CalibrationProgress&)> calibration;
  std::function<void(const std::string& step)> diagnosis;
};

// calibrate_recording, then, where recording and model disagree and `find_cause` is set, the diagnosis of the same
// recording: some seconds more, and where the catalogue explains nothing the search beyond it: up to a minute. What cannot
// be made leaves the cause open; it is no error. `aside`: the recording's sound part, in the place of all of it.
Expected<JudgedResult> judged_calibration(const Recording& recording, const CalibrationOptions& options,
                                          const Limits& limits, const Subject& subject, bool find_cause,
                                          const JudgedProgress& progress = {}, const std::stop_token& stop = {},
                                          const diagnosis::SetAside* aside = nullptr);

}  // namespace selfcal
