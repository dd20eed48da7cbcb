// From the pages in a run's folder to the answer: what the estimator's thread does.
#pragma once

#include <filesystem>
#include <string>

#include "daemon/config.hpp"
#include "daemon/estimate_worker.hpp"
#include "estimator/geometry/schedule.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// What the pages do not tell. Kept beside them, so that a restarted daemon needs no INS to go on.
struct PageContext {
  ins::SampleFormatRecord format;
  ins::SiteRecord site;
  std::uint32_t pages = 0;
};
Expected<void> write_page_context(const std::filesystem::path& folder, const PageContext& context);
Expected<PageContext> read_page_context(const std::filesystem::path& folder);

// Names of what a run's folder holds.
std::filesystem::path page_path(const std::filesystem::path& folder);
std::filesystem::path recording_path(const std::filesystem::path& folder);

struct EstimateRequest {
  std::filesystem::path folder;
  std::uint32_t rotation = 0;
  std::string serial;
  std::string started_utc;
  Schedule schedule;
  InsConfig config;
};

// All samples of the pages, gap-free from the first; warnings are about saturation.
Expected<Recording> recording_from_pages(const EstimateRequest& request, std::vector<std::string>& warnings);

EstimateJob estimate_job(EstimateRequest request);

}  // namespace selfcal
