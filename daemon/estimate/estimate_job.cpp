#include "daemon/estimate/estimate_job.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>

#include "daemon/estimate/judged_result.hpp"
#include "daemon/estimate/result_json.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/recording/hdf5.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

// The HDF5 library is not made for several threads, and every INS has an estimator's thread.
std::mutex hdf5_mutex;

// A recording that is refused takes its warnings with it: a saturated sensor is the likely cause of what is wrong.
Error with_warnings(Error error, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    error.message += "; " + warning;
  }
  return error;
}

Expected<Estimate> run_estimate(const EstimateRequest& request, const EstimateProgress& progress,
                                const std::stop_token& stop) {
  Estimate estimate;
  auto recording = recording_from_pages(request, estimate.warnings);
  if (!recording) {
    return tl::unexpected(recording.error());
  }
  // What was set aside behind the pages is wanted now (truncating to the present size frees it).
  std::error_code ignored;
  fs::resize_file(page_path(request.folder), fs::file_size(page_path(request.folder), ignored), ignored);
  {
    const std::lock_guard lock(hdf5_mutex);
    if (auto written = write_hdf5(*recording, recording_path(request.folder)); !written) {
      return tl::unexpected(written.error());
    }
  }
  estimate.recording = recording_path(request.folder).string();
  return estimate_of(*recording, std::move(estimate), request.config, progress, stop);
}

}  // namespace

Expected<Estimate> estimate_of(const Recording& recording, Estimate estimate, const InsConfig& config,
                               const EstimateProgress& progress, const std::stop_token& stop) {
  const auto suspect = check_recording(recording);
  if (!suspect) {
    return tl::unexpected(with_warnings(suspect.error(), estimate.warnings));
  }
  estimate.warnings.insert(estimate.warnings.end(), suspect->begin(), suspect->end());
  const CalibrationOptions options = calibration_options(config);
  const auto result =
      judged_calibration(recording, options, config.limit, {estimate.recording, 0}, true, {progress, {}}, stop);
  if (!result) {
    return tl::unexpected(result.error());
  }
  const auto input = document::identify_file(estimate.recording);
  if (!input) {
    return tl::unexpected(input.error());
  }
  estimate.result = result->result;
  estimate.objections = result->gate.words();
  estimate.result_json = result_json_text(*result, options, recording, estimate.warnings, false, *input);
  return estimate;
}

CalibrationOptions calibration_options(const InsConfig& config) {
  CalibrationOptions options;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    if (config.tolerance[i]) {
      options.tolerance(static_cast<Eigen::Index>(i)) = *config.tolerance[i] * sensor_parameters[i].si_per_unit;
    }
  }
  return options;
}

Expected<Recording> recording_from_pages(const EstimateRequest& request, std::vector<std::string>& warnings) {
  auto pages = PageRecording::begin(request);
  if (!pages) {
    return tl::unexpected(pages.error());
  }
  if (auto taken = pages->take(pages->pages_expected()); !taken) {
    return tl::unexpected(taken.error());
  }
  if (pages->saturated_pages() > 0) {
    warnings.push_back(fmt::format("a sensor was saturated in {} pages", pages->saturated_pages()));
  }
  const bool cut_short = pages->duration_s() < request.schedule.duration_s() - 1.0;
  const Schedule driven = cut_short ? schedule_until(request.schedule, pages->duration_s()) : request.schedule;
  Recording recording = pages->release();
  const auto& dwell = driven.dwell_s;
  if (!dwell.empty() && std::all_of(dwell.begin(), dwell.end(), [&](double s) { return s == dwell[0]; })) {
    recording.dwell_s = dwell[0];
  }
  recording.rotation_s = driven.rotation_s;
  for (const GimbalPosition& position : driven.positions) {
    recording.schedule_deg.push_back({position.outer_deg, position.inner_deg});
  }
  return recording;
}

Expected<LoadedRecording> read_kept_recording(const fs::path& path) {
  constexpr CheckPolicy lenient{.gaps_are_errors = false, .gimbal_contradiction_is_error = false};
  const std::lock_guard lock(hdf5_mutex);
  return read_hdf5(path, lenient);
}

EstimateJob estimate_job(EstimateRequest request) {
  return [request = std::move(request)](const EstimateProgress& progress, std::stop_token stop) {
    return run_estimate(request, progress, stop);
  };
}

}  // namespace selfcal
