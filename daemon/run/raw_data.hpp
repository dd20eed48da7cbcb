// The raw data of a run's rotation: the INS's directory, held against format, schedule and time, and the pages, pulled into
// the run's folder.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "daemon/run/run_steps.hpp"
#include "daemon/store/page_file.hpp"

namespace selfcal {

class RawData : public RunSteps {
 public:
  explicit RawData(const StepContext& context) : RunSteps(context) {}

  // Before anything turns: a full disk must not end a run in the middle.
  Task<Answer<Done>> check_space();
  // Reads what must be known to make a recording of the pages, and opens their file.
  Task<Answer<Done>> open();
  // The directory of this run's rotation, in agreement with format and schedule.
  Task<Answer<ins::DirectoryRecord>> read_directory();
  Task<Answer<Done>> learn_pages_written();
  // The gimbal is at rest: waits until the directory is complete.
  Task<Answer<Done>> await_completion();
  // Pulls a part of what is missing of the pages that the directory named.
  Task<Answer<Done>> pull();

  bool some_missing();
  std::uint32_t pages_known() const { return pages_known_; }  // written, by the directory
  std::uint32_t without_gap();                                // so many pages from the first
  double page_s() const { return page_s_; }                   // of data in a full page
  void close();

 private:
  std::uint32_t pages_due(const ins::DirectoryRecord& directory) const;
  Answer<Done> check_ring(const ins::DirectoryRecord& directory);
  void note_bad_page(std::uint32_t page, const std::string& why);

  struct BadPage {
    int times = 0;
    std::string why;
  };

  std::optional<PageFile> pages_;
  std::map<std::uint32_t, BadPage> bad_pages_;
  std::optional<Error> storage_error_;
  std::uint32_t pages_known_ = 0;
  double page_s_ = 0.0;
};

}  // namespace selfcal
