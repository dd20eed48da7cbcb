// From stamps as a file has them to the end of each sample's interval in seconds, and to the sample rate.
#pragma once

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/import_map.hpp"

namespace selfcal::import {

struct RateOfStamps {
  double rate_hz = 0.0;
  double resolution_s = 0.0;  // of the stamps: what all intervals are multiples of, 0: not seen
  double jitter = 0.0;        // rms of the intervals about the nominal one, in parts of it
  std::size_t gaps = 0;       // intervals of more than 1.5 nominal ones that the next ones do not make up for
};

// Of increasing stamps, in their own unit times SECONDS: mean over all intervals that are no gaps, rounded to what the
// stamps' resolution can tell.
RateOfStamps rate_of(const std::vector<long double>& stamps, long double seconds);

struct TimeAxis {
  std::vector<double> end_s;
  double rate_hz = 0.0;
  std::vector<std::string> notes;
};

// An error where time does not increase.
Expected<TimeAxis> time_axis(const ColumnData& data, const ImportMap& map, const std::string& file);

}  // namespace selfcal::import
