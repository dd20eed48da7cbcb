// From the pages in a run's folder to the answer: what the estimator's thread does.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/store/page_recording.hpp"
#include "protocol/recording/check.hpp"

namespace selfcal {

CalibrationOptions calibration_options(const InsConfig& config);

// All samples of the pages, gap-free from the first; warnings are about saturation.
Expected<Recording> recording_from_pages(const EstimateRequest& request, std::vector<std::string>& warnings);

// Checks, calibrates and judges it. `estimate` holds its file and the warnings so far.
Expected<Estimate> estimate_of(const Recording& recording, Estimate estimate, const InsConfig& config,
                               const EstimateProgress& progress, const std::stop_token& stop);

EstimateJob estimate_job(EstimateRequest request);

// A recording that a run kept, as `selfcal diagnose` would read it.
Expected<LoadedRecording> read_kept_recording(const std::filesystem::path& path);

}  // namespace selfcal
