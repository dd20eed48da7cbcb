// A file that appears under its name complete and on disk, or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal {

// Name of the temporary file for `path`: same folder (so that rename stays within a file system), own process id.
std::filesystem::path temporary_beside(const std::filesystem::path& path);

// Syncs the finished temporary file, renames it to `path` and syncs the folder. On failure the temporary file is
// removed and `path` is as it was.
Expected<void> commit_file(const std::filesystem::path& temporary, const std::filesystem::path& path);

// Writes `contents` so to `path`.
Expected<void> write_file_atomically(const std::filesystem::path& path, std::string_view contents);

// Whole file as text; an error where it cannot be read or is longer than `limit` bytes.
Expected<std::string> read_text_file(const std::filesystem::path& path, std::size_t limit);

}  // namespace selfcal
