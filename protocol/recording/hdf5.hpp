// Recording interchange format version 1, as an HDF5 file.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/recording/check.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// Reads and checks a recording: any chunking and compression that the HDF5 library knows, f4 or f8, fixed or
// variable strings; unknown attributes and datasets are ignored. Errors (bad_input) name file, dataset, row, value. The library parses in a
// child process (isolated_parse.hpp): a damaged file that kills it is an error like any other.
Expected<LoadedRecording> read_hdf5(const std::filesystem::path& path, const CheckPolicy& policy = {});

// The same from a file image in memory (`name` is what messages call it).
Expected<LoadedRecording> read_hdf5_image(const void* image, std::size_t size, const std::string& name,
                                          const CheckPolicy& policy = {});

// Whether it is an HDF5 file that says no format of a recording: another program's. What is damaged is none.
bool is_foreign_hdf5(const std::filesystem::path& path);

// Writes f8, chunked, shuffled and deflated. The file appears under its name complete and on disk, or not at all:
// it is written beside its place, synced, and renamed; an existing file is replaced only by a complete one. A full
// disk or an unwritable folder is an error (internal: it is this machine that fails) and leaves no partial file.
// ORIGIN, where the recording comes from: further text attributes of the root, which readers pass over; 60 kB each.
using TextAttributes = std::vector<std::pair<std::string, std::string>>;
Expected<void> write_hdf5(const Recording& recording, const std::filesystem::path& path,
                          const TextAttributes& origin = {});

}  // namespace selfcal
