// Room for recordings: the quota, the age rule, and what a run needs before it starts.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/store/run_store.hpp"

namespace selfcal {

struct RecordingRules {
  double quota_mib = 0.0;
  double keep_days = 0.0;  // 0: for ever
};

struct PrunedRecording {
  RunRecord run;  // as before
  std::string why;
};

// Removes the recordings of ended runs, oldest first, until quota and age are kept; results stay. A file that cannot be
// removed is left, and its run keeps its path.
Expected<std::vector<PrunedRecording>> prune_recordings(RunStore& store, const RecordingRules& rules,
                                                        std::filesystem::file_time_type now);

// Bytes on disk that a run of so many samples takes at most: its raw pages and then its recording.
std::uint64_t bytes_of_a_run(std::uint64_t samples);

// Fails (device) with less than `bytes` free for the daemon's user, saying how much there is and what for.
Expected<void> require_space(const std::filesystem::path& folder, std::uint64_t bytes, const std::string& what_for);

}  // namespace selfcal
