#include "tools/cli/import_as_run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/recording/file_hash.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/convert.hpp"
#include "tools/cli/online_client.hpp"
#include "tools/cli/online_run.hpp"

namespace selfcal::cli {
namespace {

// 2026-11-21T07:10:00Z of any ISO 8601 time in UTC; empty where it is none, and the service takes its own time.
std::string whole_seconds(const std::string& iso) {
  constexpr std::size_t to_the_second = 19;
  const bool utc = iso.size() > to_the_second && (iso.ends_with('Z') || iso.ends_with("+00:00"));
  return utc ? iso.substr(0, to_the_second) + "Z" : std::string();
}

// Who recorded it, as the operator says, and the very file.
Expected<std::string> source_of(const std::filesystem::path& origin, const std::string& words) {
  return sha256_of_file(origin).map([&](const std::string& hash) {
    return fmt::format("{}{}{}, SHA-256 {}", words, words.empty() ? "" : ", ", origin.filename().string(), hash);
  });
}

Expected<std::uint64_t> hand_over(ManagerClient& manager, const std::filesystem::path& recording,
                                  const Entries& options) {
  const int descriptor = ::open(recording.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", recording.string(), std::strerror(errno)));
  }
  auto run = manager.import_recording(descriptor, options);
  ::close(descriptor);
  return run;
}

}  // namespace

Expected<int> import_as_run(const std::filesystem::path& recording, const std::filesystem::path& origin,
                            const AsRun& as_run) {
  const Expected<LoadedRecording> loaded = read_hdf5(recording, lenient);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  Entries options;
  options["serial"] = as_run.serial.empty() ? loaded->recording.serial : as_run.serial;
  if (options["serial"].get<std::string>().empty()) {
    return fail(ErrorKind::usage, fmt::format("{}: names no INS: --serial is required", recording.string()));
  }
  const auto source = source_of(origin, as_run.source);
  if (!source) {
    return tl::unexpected(source.error());
  }
  options["source"] = *source;
  if (!as_run.ins.empty()) {
    options["ins"] = as_run.ins;
  }
  if (const std::string utc = whole_seconds(loaded->recording.start_time_utc); !utc.empty()) {
    options["measured_utc"] = utc;
  }
  auto manager = ManagerClient::connect();
  if (!manager) {
    return tl::unexpected(manager.error());
  }
  const auto run = hand_over(**manager, recording, options);
  if (!run) {
    return tl::unexpected(run.error());
  }
  constexpr auto between_looks = std::chrono::milliseconds(200);
  while (true) {
    const auto document = (*manager)->show(*run);
    if (!document) {
      return tl::unexpected(document.error());
    }
    const auto seen = nlohmann::json::parse(*document);
    if (!seen.at("exit_status").is_null()) {
      return report_ending(**manager, *run, {seen.at("exit_status").get<int>(), seen.at("reason").get<std::string>()},
                           as_run.json);
    }
    std::this_thread::sleep_for(between_looks);
  }
}

}  // namespace selfcal::cli
