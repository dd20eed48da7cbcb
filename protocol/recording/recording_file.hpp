// Opens a recording by the ending of its name: .csv is CSV, all else HDF5.
#pragma once

#include <filesystem>

#include "protocol/error.hpp"
#include "protocol/recording/check.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

Expected<LoadedRecording> read_recording(const std::filesystem::path& path, const CheckPolicy& policy = {});
Expected<void> write_recording(const Recording& recording, const std::filesystem::path& path);

}  // namespace selfcal
