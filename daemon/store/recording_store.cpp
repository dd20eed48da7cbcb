#include "daemon/store/recording_store.hpp"

#include <fmt/format.h>

#include <chrono>
#include <system_error>

#include "protocol/flash/page.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

constexpr double mebibyte = 1048576.0;
// time, 3 delta_theta, 3 delta_v, 2 gimbal angles, temperature; uncompressed doubles.
constexpr std::uint64_t recording_bytes_per_sample = 10 * sizeof(double);
// Attributes and chunk index of the recording, growth of the database by a run.
constexpr std::uint64_t overhead_bytes = 4 << 20;

double size_mib(const RunRecord& run) {
  std::error_code error;
  const auto bytes = fs::file_size(run.recording, error);
  return error ? 0.0 : static_cast<double>(bytes) / mebibyte;
}

bool older_than(const RunRecord& run, double days, fs::file_time_type now) {
  std::error_code error;
  const auto written = fs::last_write_time(run.recording, error);
  if (error || days <= 0) {
    return false;
  }
  return std::chrono::duration<double>(now - written).count() > days * 86400.0;
}

}  // namespace

Expected<std::vector<PrunedRecording>> prune_recordings(RunStore& store, const RecordingRules& rules,
                                                        fs::file_time_type now) {
  const auto runs = store.runs_with_recordings();
  if (!runs) {
    return tl::unexpected(runs.error());
  }
  double total = 0.0;
  for (const RunRecord& run : *runs) {
    total += size_mib(run);
  }
  std::vector<PrunedRecording> pruned;
  for (const RunRecord& run : *runs) {
    const bool too_old = older_than(run, rules.keep_days, now);
    if (total <= rules.quota_mib && !too_old) {
      continue;
    }
    const double size = size_mib(run);
    std::error_code error;
    fs::remove(run.recording, error);
    if (error) {
      continue;
    }
    total -= size;
    RunRecord without = run;
    without.recording.clear();
    if (auto stored = store.update_run(without); !stored) {
      return tl::unexpected(stored.error());
    }
    pruned.push_back({run, too_old ? "older than recordings_keep_days" : "over recordings_quota_mib"});
  }
  return pruned;
}

std::uint64_t bytes_of_a_run(std::uint64_t samples) {
  const std::uint64_t pages = samples / flash::samples_per_page + 1;
  return pages * flash::page_bytes + samples * recording_bytes_per_sample + overhead_bytes;
}

Expected<void> require_space(const fs::path& folder, std::uint64_t bytes, const std::string& what_for) {
  std::error_code error;
  const auto space = fs::space(folder, error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", folder.string(), error.message()));
  }
  if (space.available >= bytes) {
    return {};
  }
  return fail(ErrorKind::device, fmt::format("{}: {:.0f} MiB free, {} needs {:.0f} MiB", folder.string(),
                                             static_cast<double>(space.available) / mebibyte, what_for,
                                             static_cast<double>(bytes) / mebibyte));
}

}  // namespace selfcal
