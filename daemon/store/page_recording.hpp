// A recording that grows with the pages of a rotation, and what must be known to make it of them.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "daemon/host/config.hpp"
#include "estimator/geometry/schedule.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// What the pages do not hold. It is kept beside them, so that a restarted daemon needs no INS to continue.
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
// Of a run that has ended: the recording stays, everything else goes.
void drop_pages(const std::filesystem::path& folder);

struct EstimateRequest {
  std::filesystem::path folder;
  std::uint32_t rotation = 0;
  std::string serial;
  std::string started_utc;
  Schedule schedule;
  InsConfig config;
};

// The part of a schedule that lies before `seconds`, its last dwell cut there; the whole where that is shorter.
Schedule schedule_until(const Schedule& schedule, double seconds);

class PageRecording {
 public:
  static Expected<PageRecording> begin(const EstimateRequest& request);

  // Takes up the pages below `end` that are not in it yet. The samples must follow each other without a gap.
  Expected<void> take(std::uint32_t end);

  std::uint32_t pages_expected() const { return context_.pages; }  // or written, where the rotation is over
  std::uint32_t saturated_pages() const { return saturated_; }
  double duration_s() const;
  const Recording& recording() const { return recording_; }
  Recording release() { return std::move(recording_); }

 private:
  PageRecording(const EstimateRequest& request, PageContext context);

  std::filesystem::path file_;
  std::uint32_t rotation_;
  PageContext context_;
  Recording recording_;
  std::uint32_t taken_ = 0;
  std::uint32_t saturated_ = 0;
};

}  // namespace selfcal
