#include "daemon/hub/recording_folder.hpp"

#include <fmt/format.h>

#include <system_error>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/file_hash.hpp"

namespace selfcal::hub {

namespace fs = std::filesystem;

fs::path recording_path(const fs::path& folder, const std::string& sha256) {
  return folder / sha256.substr(0, 2) / sha256;
}

Expected<KeptRecording> keep_recording(const fs::path& file, const fs::path& folder) {
  auto hash = sha256_of_file(file);
  if (!hash) {
    return tl::unexpected(hash.error());
  }
  std::error_code error;
  const fs::path target = recording_path(folder, *hash);
  const auto bytes = static_cast<std::int64_t>(fs::file_size(file, error));
  if (!error && fs::exists(target, error)) {
    return KeptRecording{*hash, bytes};
  }
  fs::create_directories(target.parent_path(), error);
  const fs::path temporary = temporary_beside(target);
  if (!error) {
    fs::copy_file(file, temporary, fs::copy_options::overwrite_existing, error);
  }
  if (!error) {
    fs::permissions(temporary, fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read, error);
  }
  if (error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    return fail(ErrorKind::device, fmt::format("recordings {}: {}: {}", folder.string(), *hash, error.message()));
  }
  if (auto ok = commit_file(temporary, target); !ok) {
    return tl::unexpected(ok.error());
  }
  return KeptRecording{*hash, bytes};
}

std::string recording_fault(const fs::path& folder, const std::string& sha256, std::int64_t bytes) {
  const fs::path file = recording_path(folder, sha256);
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) {
    return fmt::format("recording {}: {}", file.string(), error.message());
  }
  if (static_cast<std::int64_t>(size) != bytes) {
    return fmt::format("recording {}: {} bytes, {} expected", file.string(), size, bytes);
  }
  const auto hash = sha256_of_file(file);
  if (!hash) {
    return hash.error().message;
  }
  return *hash == sha256 ? std::string() : fmt::format("recording {}: its SHA-256 is {}", file.string(), *hash);
}

}  // namespace selfcal::hub
