// Parsing by the HDF5 library within this process. Private to this folder: libhdf5 1.10 does not survive every
// damaged file, so callers go through isolated_parse.hpp.
#pragma once

#include <cstddef>
#include <string>

#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::hdf5 {

// Form only: presence, shapes, types, sizes. Values are check_recording's.
Expected<Recording> parse_file(const std::string& path);
Expected<Recording> parse_image(const void* image, std::size_t size, const std::string& name);

}  // namespace selfcal::hdf5
