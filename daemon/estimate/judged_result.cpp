#include "daemon/estimate/judged_result.hpp"

#include <chrono>

#include "daemon/estimate/calibrate_recording.hpp"

namespace selfcal {
namespace {

std::optional<diagnosis::Diagnosis> diagnosis_of(const Recording& recording, const CalibrationOptions& calibration,
                                                 const std::function<void(const std::string&)>& progress,
                                                 const std::stop_token& stop) {
  std::vector<double> first_temperature;
  const ImuData data = imu_view(recording, first_temperature);
  diagnosis::DiagnosisOptions options;
  options.calibration = calibration;
  options.stop = stop;
  return diagnosis::diagnose(data, options, progress).diagnosis;
}

}  // namespace

JudgedResult judged(CalibrationResult result, const ParameterVector& tolerance, const Limits& limits,
                    const Subject& subject, std::optional<diagnosis::Diagnosis> diagnosis) {
  JudgedResult all;
  all.gate = judge(result, tolerance, limits);
  all.summary = summary_of(result, all.gate, subject, diagnosis ? &*diagnosis : nullptr);
  all.result = std::move(result);
  all.diagnosis = std::move(diagnosis);
  return all;
}

Expected<JudgedResult> judged_calibration(const Recording& recording, const CalibrationOptions& options,
                                          const Limits& limits, const Subject& subject, bool find_cause,
                                          const JudgedProgress& progress, const std::stop_token& stop) {
  const auto begun = std::chrono::steady_clock::now();
  Expected<CalibrationResult> result = calibrate_recording(recording, options, progress.calibration, stop);
  if (!result) {
    return tl::unexpected(result.error());
  }
  std::optional<diagnosis::Diagnosis> diagnosis;
  if (find_cause && result->consistency.verdict == Verdict::inconsistent) {
    diagnosis = diagnosis_of(recording, options, progress.diagnosis, stop);
    result->elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
  return judged(std::move(*result), options.tolerance, limits, subject, std::move(diagnosis));
}

}  // namespace selfcal
