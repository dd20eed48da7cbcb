#include "daemon/estimate/amendment_job.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/estimate_job.hpp"
#include "daemon/estimate/judged_result.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "daemon/estimate/result_json.hpp"
#include "daemon/estimate/search_beyond.hpp"
#include "daemon/estimate/showing_schedule.hpp"
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

// The 24 with laws that several recordings confirm.
CalibrationResult result_with_laws(const diagnosis::Diagnosis& diagnosis, const BeyondAnswer& beyond,
                                   const CalibrationOptions& options) {
  CalibrationResult result = diagnosis.calibration;
  result.value = beyond.found.average.parameters.front();
  result.covariance = beyond.found.average.covariance.front();
  result.covariance += diagnosis.open_beside_named;
  result.sigma = result.covariance.diagonal().cwiseSqrt();
  judge_parameters(result, options.tolerance);
  Consistency& consistency = result.consistency;
  consistency.verdict = Verdict::consistent;
  consistency.nis_mean = 1.0 + beyond.found.misfit_after / std::max(1.0, beyond.found.rows);
  consistency.words =
      fmt::format("With what {} recordings show beyond the catalogue fitted too they and the model agree: {}.",
                  beyond.found.fit.recordings.size(), discovered_figures(beyond.found));
  return result;
}

// A recording with all that is made of it; stays where it is, for the view points into it.
struct Taken {
  document::InputFile file;
  LoadedRecording loaded;
  std::vector<double> first_temperature;
  ImuData data;
  diagnosis::Diagnosis diagnosis;
};

Expected<std::unique_ptr<Taken>> take(const KeptRecording& kept, const diagnosis::DiagnosisOptions& options,
                                      const std::function<void()>& progress) {
  auto loaded = read_kept_recording(kept.file);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  auto file = document::identify_file(kept.file.string());
  if (!file) {
    return tl::unexpected(file.error());
  }
  auto taken = std::make_unique<Taken>();
  taken->file = std::move(*file);
  taken->loaded = std::move(*loaded);
  taken->data = imu_view(taken->loaded.recording, taken->first_temperature);
  diagnosis::DiagnosisOutcome outcome =
      diagnosis::diagnose(taken->data, options, [&](const std::string&) { progress(); });
  if (!outcome.diagnosis) {
    return fail(ErrorKind::bad_input, fmt::format("run {}: {}", kept.run, outcome.failure));
  }
  taken->diagnosis = std::move(*outcome.diagnosis);
  return taken;
}

// A second recording where the first shows something and no law to be told from others: between the positions of the first, in
// about its time.
discovery::NextExperiment second_look(const Schedule& done) {
  constexpr double least_dwell_s = 40.0;
  discovery::NextExperiment next;
  next.schedule = dwells_between(done).schedule;
  const double shorter = done.duration_s() / next.schedule.duration_s();
  for (double& dwell : next.schedule.dwell_s) {
    dwell = std::max(least_dwell_s, std::round(shorter * dwell));
  }
  return next;
}

// Nothing where there is one recording and the catalogue explains it. A walk or an instability that equations explain is no name.
Expected<std::optional<BeyondAnswer>> look_beyond(const AmendmentRequest& request,
                                                  const std::vector<std::unique_ptr<Taken>>& taken,
                                                  const diagnosis::DiagnosisOptions& of_catalogue,
                                                  const std::function<void()>& progress, const std::stop_token& stop) {
  if (!taken.front()->diagnosis.faults.empty()) {
    return std::nullopt;
  }
  std::vector<DiagnosedFile> files;
  files.reserve(taken.size());
  for (const auto& t : taken) {
    files.push_back({t->file, t->data, t->diagnosis});
  }
  discovery::DiscoveryOptions of_laws;
  of_laws.stop = stop;
  of_laws.coloured = taken.front()->diagnosis.before.coloured;
  const discovery::Progress step = [&](const std::string&) { progress(); };
  diagnosis::Diagnosis& first = taken.front()->diagnosis;
  auto searched = search_beyond(recordings_of(files), of_catalogue, of_laws, first, Search::where_due, step);
  if (!searched) {
    return fail(ErrorKind::bad_input, fmt::format("run {}: {}", request.amends.run, searched.error()));
  }
  auto& search = *searched;
  if (!search || (taken.size() == 1 && !first.unexplained)) {
    return std::nullopt;
  }
  const auto joint = fit_together(search->rest, search->found, first, stop);
  if (!joint) {
    return fail(ErrorKind::bad_input, fmt::format("run {}: {}", request.amends.run, joint.error()));
  }
  BeyondAnswer answer;
  answer.found = std::move(search->found);
  const discovery::UnexplainedRest& rest = search->rest;
  if (files.size() > 1) {
    answer.together = put_together(files, rest, **joint);
    answer.joint = *joint;
  }
  progress();
  discovery::ExperimentLimits limits;
  limits.rotation_s = request.config.rotation_s;
  answer.next = plan_next(rest.recordings(), answer.found, limits, stop);
  if (!answer.next && taken.size() == 1) {
    answer.next = second_look(schedule_of(taken.front()->loaded.recording, taken.front()->data));
  }
  return answer;
}

Expected<Estimate> run_amendment(const AmendmentRequest& request, const EstimateProgress& progress,
                                 const std::stop_token& stop) {
  const auto begun = std::chrono::steady_clock::now();
  diagnosis::DiagnosisOptions options;
  options.calibration = calibration_options(request.config);
  options.stop = stop;
  CalibrationProgress step;
  step.value.setZero();  // the diagnosis has no estimate to show on its way
  step.sigma.setZero();
  const auto report = [&] {
    ++step.pass;
    progress(step);
  };
  std::vector<std::unique_ptr<Taken>> taken;
  std::vector<KeptRecording> all = {request.amends};
  all.insert(all.end(), request.with.begin(), request.with.end());
  for (const KeptRecording& kept : all) {
    auto one = take(kept, options, report);
    if (!one) {
      return tl::unexpected(one.error());
    }
    if (!taken.empty() && !(*one)->diagnosis.faults.empty()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("data fault in run {}: {}", kept.run, (*one)->diagnosis.faults.front().words));
    }
    taken.push_back(std::move(*one));
  }
  if (auto kept = keep_copy(request.amends.file, recording_path(request.folder)); !kept) {
    return tl::unexpected(kept.error());
  }
  diagnosis::Diagnosis& diagnosis = taken.front()->diagnosis;
  auto beyond = look_beyond(request, taken, options, report, stop);
  if (!beyond) {
    return tl::unexpected(beyond.error());
  }
  std::optional<discovery::NextExperiment> next;
  if (doubtful(diagnosis)) {
    discovery::ExperimentLimits limits;
    limits.rotation_s = request.config.rotation_s;
    next = discovery::plan_against_names({taken.front()->data, diagnosis.calibration}, diagnosis, limits, stop);
  }
  diagnosis.calibration.elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  Estimate estimate = amended_estimate(diagnosis, request, taken.front()->loaded.recording, std::move(*beyond), next);
  estimate.warnings = taken.front()->loaded.warnings;
  return estimate;
}

}  // namespace

Estimate amended_estimate(const diagnosis::Diagnosis& diagnosis, const AmendmentRequest& request,
                          const Recording& recording, std::optional<BeyondAnswer> beyond,
                          const std::optional<discovery::NextExperiment>& next) {
  const CalibrationOptions options = calibration_options(request.config);
  const discovery::Discovery* found = beyond ? &beyond->found : nullptr;
  Estimate estimate;
  JudgedResult judged;
  judged.result = confirmed(found) ? result_with_laws(diagnosis, *beyond, options) : amended_result(diagnosis, options);
  judged.diagnosis = diagnosis;
  judged.gate =
      judge_amended(judged.result, options.tolerance, request.config.limit, diagnosis, request.amends.run, found);
  estimate.recording = recording_path(request.folder).string();
  judged.summary = summary_of_amended(judged.result, judged.gate, {estimate.recording, 0}, diagnosis, found);
  estimate.result = judged.result;
  estimate.objections = judged.gate.words();
  for (const diagnosis::Finding& finding : diagnosis.findings) {
    estimate.notes.push_back(story(finding));
  }
  if (diagnosis.instead) {
    estimate.notes.push_back(in_place_words(diagnosis));
  }
  if (explains(found)) {
    estimate.notes.push_back(discovered_figures(*found));
  }
  if (beyond) {
    judged.beyond = beyond->found;
  }
  nlohmann::ordered_json document = result_json(judged, options, recording, {});
  document["amends"] = request.amends.run;
  if (beyond && beyond->together) {
    document["together"] = together_json(*beyond->together);
    document["fitted_effects"] = fitted_effects_json(*beyond->joint);
  }
  add_next_experiment(document, beyond ? beyond->next : next);
  estimate.result_json = document.dump();
  return estimate;
}

EstimateJob amendment_job(AmendmentRequest request) {
  return [request = std::move(request)](const EstimateProgress& progress, std::stop_token stop) {
    return run_amendment(request, progress, stop);
  };
}

}  // namespace selfcal
