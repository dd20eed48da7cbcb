#include "tools/cli/output_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace selfcal::cli {

Expected<void> check_output(const std::string& file, std::initializer_list<std::string_view> endings) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (std::find(endings.begin(), endings.end(), ending) == endings.end()) {
    return fail(ErrorKind::usage, fmt::format("{}: {} can be written", file, fmt::join(endings, " or ")));
  }
  return check_folder(file);
}

Expected<void> check_folder(const std::string& file) {
  std::filesystem::path folder = std::filesystem::path(file).parent_path();
  folder = folder.empty() ? "." : folder;
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return fail(ErrorKind::bad_input, fmt::format("{}: no folder {}", file, folder.string()));
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: {}", file, folder.string(), std::strerror(errno)));
  }
  return {};
}

}  // namespace selfcal::cli
