// A map applied to a file: the recording that it makes.
#pragma once

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/import_map.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::import {

struct Imported {
  Recording recording;
  std::vector<std::string> notes;  // what was done that the file does not say: a rate taken from stamps, resampling
};

// A value whose unit, scale and sign say nothing else is taken over bit for bit. Errors (bad_input) name the file's
// line and column, or the map's line and key. A word in `unsettled` is an error.
Expected<Imported> build_recording(const ColumnSource& source, const ImportMap& map, const std::string& file);

}  // namespace selfcal::import
