#include "daemon/estimate/amendment_job.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/estimate_job.hpp"
#include "daemon/estimate/judged_result.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "daemon/estimate/result_json.hpp"
#include "estimator/passes/consistency.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

// So that the quota may take either run's file without the other's.
Expected<void> keep_copy(const fs::path& from, const fs::path& to) {
  std::error_code error;
  if (fs::exists(to, error)) {
    return {};  // of an attempt before the daemon was restarted
  }
  fs::create_hard_link(from, to, error);
  if (error) {
    fs::copy_file(from, to, error);
  }
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", to.string(), error.message()));
  }
  return {};
}

// As in the catalogue's own tests: the verdict is the diagnosis's, on what remains after the fit.
CalibrationResult amended_result(const diagnosis::Diagnosis& diagnosis, const CalibrationOptions& options) {
  CalibrationResult result = diagnosis.calibration;
  result.value = diagnosis.value;
  result.sigma = diagnosis.sigma;
  result.covariance = diagnosis.covariance;
  judge_parameters(result, options.tolerance);
  Consistency& consistency = result.consistency;
  consistency.verdict = diagnosis.after.accepted ? Verdict::consistent : Verdict::inconsistent;
  consistency.nis_mean = diagnosis.after.nis;
  consistency.whiteness_p_value = std::exp(diagnosis.after.log_p_white);
  std::vector<std::string> names;
  for (const diagnosis::Finding& finding : diagnosis.findings) {
    names.push_back(finding.effect);
  }
  consistency.words =
      fmt::format("With {} fitted too the recording and the model {}: NIS {:.3f}, before {:.3f}.",
                  names.empty() ? "nothing" : fmt::format("{}", fmt::join(names, ", ")),
                  diagnosis.after.accepted ? "agree" : "disagree still", diagnosis.after.nis, diagnosis.before.nis);
  return result;
}

// Effects that cannot be told apart need no objection: sigma holds what the 24 differ by between them.
std::string story(const diagnosis::Finding& finding) {
  std::string text = fmt::format("{}, {:.0f} sigma:", finding.effect, finding.significance);
  for (const diagnosis::FindingParameter& p : finding.parameters) {
    text += fmt::format(" {} {}", p.name, with_sigma(p.value, p.sigma, p.unit));
  }
  if (!finding.equivalent.empty()) {
    text += fmt::format("; or {}", fmt::join(finding.equivalent, ", "));
  }
  return text;
}

Expected<Estimate> run_amendment(const AmendmentRequest& request, const EstimateProgress& progress,
                                 const std::stop_token& stop) {
  const auto begun = std::chrono::steady_clock::now();
  const auto loaded = read_kept_recording(request.recording);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  if (auto kept = keep_copy(request.recording, recording_path(request.folder)); !kept) {
    return tl::unexpected(kept.error());
  }
  std::vector<double> first_temperature;
  const ImuData data = imu_view(loaded->recording, first_temperature);
  diagnosis::DiagnosisOptions options;
  options.calibration = calibration_options(request.config);
  options.stop = stop;
  CalibrationProgress step;
  step.value.setZero();  // the diagnosis has no estimate to show on its way
  step.sigma.setZero();
  diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(data, options, [&](const std::string&) {
    ++step.pass;
    progress(step);
  });
  if (!outcome.diagnosis) {
    return fail(ErrorKind::bad_input, fmt::format("run {}: {}", request.amends, outcome.failure));
  }
  outcome.diagnosis->calibration.elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::optional<discovery::Discovery> beyond;
  if (outcome.diagnosis->unexplained) {
    beyond = search_beyond(data, *outcome.diagnosis, {}, stop);
  }
  Estimate estimate = amended_estimate(*outcome.diagnosis, request, loaded->recording, std::move(beyond));
  estimate.warnings = loaded->warnings;
  return estimate;
}

}  // namespace

Estimate amended_estimate(const diagnosis::Diagnosis& diagnosis, const AmendmentRequest& request,
                          const Recording& recording, std::optional<discovery::Discovery> beyond) {
  const CalibrationOptions options = calibration_options(request.config);
  Estimate estimate;
  JudgedResult judged;
  judged.result = amended_result(diagnosis, options);
  judged.diagnosis = diagnosis;
  judged.beyond = std::move(beyond);
  const discovery::Discovery* found = judged.beyond ? &*judged.beyond : nullptr;
  judged.gate = judge_amended(judged.result, options.tolerance, request.config.limit, diagnosis, request.amends, found);
  estimate.recording = recording_path(request.folder).string();
  judged.summary = summary_of_amended(judged.result, judged.gate, {estimate.recording, 0}, diagnosis, found);
  estimate.result = judged.result;
  estimate.objections = judged.gate.words();
  for (const diagnosis::Finding& finding : diagnosis.findings) {
    estimate.notes.push_back(story(finding));
  }
  nlohmann::ordered_json document = result_json(judged, options, recording, {});
  document["amends"] = request.amends;
  estimate.result_json = document.dump();
  return estimate;
}

EstimateJob amendment_job(AmendmentRequest request) {
  return [request = std::move(request)](const EstimateProgress& progress, std::stop_token stop) {
    return run_amendment(request, progress, stop);
  };
}

}  // namespace selfcal
