#include "daemon/estimate/judged_result.hpp"

#include <chrono>

#include "daemon/estimate/analysis.hpp"
#include "daemon/estimate/calibrate_recording.hpp"

namespace selfcal {
JudgedResult judged(CalibrationResult result, const ParameterVector& tolerance, const Limits& limits,
                    const Subject& subject, std::optional<diagnosis::Diagnosis> diagnosis,
                    std::optional<discovery::Discovery> beyond) {
  JudgedResult all;
  all.gate = judge(result, tolerance, limits);
  all.summary = summary_of(result, all.gate, subject, diagnosis ? &*diagnosis : nullptr, beyond ? &*beyond : nullptr);
  all.result = std::move(result);
  all.diagnosis = std::move(diagnosis);
  all.beyond = std::move(beyond);
  return all;
}

Expected<JudgedResult> judged_calibration(const Recording& recording, const CalibrationOptions& options,
                                          const Limits& limits, const Subject& subject, bool find_cause,
                                          const JudgedProgress& progress, const std::stop_token& stop,
                                          const diagnosis::SetAside* aside) {
  const auto begun = std::chrono::steady_clock::now();
  Expected<CalibrationResult> result = calibrate_recording(recording, options, progress.calibration, stop, aside);
  if (!result) {
    return tl::unexpected(result.error());
  }
  Cause cause;
  if (find_cause && result->consistency.verdict == Verdict::inconsistent) {
    std::vector<double> first_temperature;
    diagnosis::DiagnosisOptions of_catalogue;
    of_catalogue.calibration = options;
    of_catalogue.stop = stop;
    cause = cause_of(aside != nullptr ? aside->data() : imu_view(recording, first_temperature), of_catalogue,
                     progress.diagnosis);
    result->elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
  return judged(std::move(*result), options.tolerance, limits, subject, std::move(cause.diagnosis),
                std::move(cause.beyond));
}

}  // namespace selfcal
