// The shared folder of a depot's recordings: each file is named by its SHA-256 and never changes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "protocol/error.hpp"

namespace selfcal::hub {

// FOLDER/ab/abcd...: 256 folders, so that none holds too many.
std::filesystem::path recording_path(const std::filesystem::path& folder, const std::string& sha256);

struct KeptRecording {
  std::string sha256;
  std::int64_t bytes = 0;
};

// Copies the file there unless it is there; read only, complete or not at all. An error (device) where it cannot be read or
// written.
Expected<KeptRecording> keep_recording(const std::filesystem::path& file, const std::filesystem::path& folder);

// Empty, or what is wrong with the file of this name: absent, another length, another content.
std::string recording_fault(const std::filesystem::path& folder, const std::string& sha256, std::int64_t bytes);

}  // namespace selfcal::hub
