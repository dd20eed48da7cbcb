// Recording interchange format version 1, as CSV: one header line with the dataset names (vector components
// suffixed _x, _y, _z; more temperature channels than one: temperature_c_0, temperature_c_1, ...), one line per
// sample; the attributes and schedule_deg in a TOML file of the same stem beside it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "protocol/error.hpp"
#include "protocol/recording/check.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// Reads and checks `path` and its TOML file (same stem, .toml). Errors (bad_input) name file, line, column, value.
Expected<LoadedRecording> read_csv(const std::filesystem::path& path, const CheckPolicy& policy = {});

// The same from text in memory.
Expected<LoadedRecording> parse_csv(std::string_view csv, std::string_view attributes_toml, const std::string& name,
                                    const CheckPolicy& policy = {});

// Writes both files, each complete or not at all (as write_hdf5); numbers are written so that they read back to
// the same bits.
Expected<void> write_csv(const Recording& recording, const std::filesystem::path& path);

}  // namespace selfcal
