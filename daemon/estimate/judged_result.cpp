#include "daemon/estimate/judged_result.hpp"

#include <chrono>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/calibrate_recording.hpp"

namespace selfcal {
namespace {

struct Cause {
  std::optional<diagnosis::Diagnosis> diagnosis;
  std::optional<discovery::Discovery> beyond;
};

Cause cause_of(const Recording& recording, const CalibrationOptions& calibration,
               const std::function<void(const std::string&)>& progress, const std::stop_token& stop) {
  std::vector<double> first_temperature;
  const ImuData data = imu_view(recording, first_temperature);
  diagnosis::DiagnosisOptions options;
  options.calibration = calibration;
  options.stop = stop;
  Cause cause{diagnosis::diagnose(data, options, progress).diagnosis, std::nullopt};
  if (cause.diagnosis && cause.diagnosis->unexplained) {
    cause.beyond = search_beyond(data, *cause.diagnosis, progress, stop);
  }
  return cause;
}

}  // namespace

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
                                          const JudgedProgress& progress, const std::stop_token& stop) {
  const auto begun = std::chrono::steady_clock::now();
  Expected<CalibrationResult> result = calibrate_recording(recording, options, progress.calibration, stop);
  if (!result) {
    return tl::unexpected(result.error());
  }
  Cause cause;
  if (find_cause && result->consistency.verdict == Verdict::inconsistent) {
    cause = cause_of(recording, options, progress.diagnosis, stop);
    result->elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
  return judged(std::move(*result), options.tolerance, limits, subject, std::move(cause.diagnosis),
                std::move(cause.beyond));
}

}  // namespace selfcal
