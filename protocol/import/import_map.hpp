// How the columns of a file become a recording: a TOML file that `selfcal import --guess` writes and people mend.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/text_dialect.hpp"

namespace selfcal::import {

// A column by its number, counted from 1, or by its name.
struct ColumnRef {
  std::size_t number = 0;  // 0: by name
  std::string name;
};

// One of a triad's columns along an axis of b: -1, 1 and which of the three.
struct AxisSource {
  int column = 0;
  double sign = 1.0;
};

struct TriadMap {
  std::array<ColumnRef, 3> columns;
  bool increments = false;                                         // else rates
  std::string unit;                                                // units.hpp; "counts" are units of `scale`
  std::array<double, 3> scale{1, 1, 1};                            // of the columns, in `unit` a count
  std::array<double, 3> zero{};                                    // counts that mean nothing, of the columns
  std::array<AxisSource, 3> axes{{{0, 1.0}, {1, 1.0}, {2, 1.0}}};  // of b, x y z
};

struct TimeMap {
  std::optional<ColumnRef> column;    // none: rows follow each other at the sample rate
  std::string unit = "s";             // or "date"
  std::string stamp = "end";          // of the interval: begin, middle, end
  std::string interval = "nominal";   // what a rate is multiplied by: nominal, stamps
  std::optional<double> origin;       // s, taken from the stamps
  bool origin_first = false;          // the first sample's interval begins at 0
  bool resample = false;              // onto a uniform grid
  bool leave_out_incomplete = false;  // rows that lack a number are lost samples; else an error
};

struct GimbalMap {
  std::optional<ColumnRef> outer;
  std::optional<ColumnRef> inner;
  std::string unit = "deg";
  std::array<double, 2> signs{1.0, 1.0};
  std::array<double, 2> offsets_deg{};             // added after the signs
  std::optional<std::array<double, 2>> fixed_deg;  // it stood still so
  bool absent = false;                             // turned by hand or not at all: read-outs are written as 0
};

struct ImportMap {
  std::optional<TextDialect> dialect;  // else what the text shows
  std::string serial = "unknown";
  std::string start_time_utc;
  std::optional<double> sample_rate_hz;  // else from the stamps
  std::optional<double> dwell_s;
  std::optional<double> rotation_s;
  std::optional<double> latitude_deg;
  std::optional<double> longitude_deg;
  std::optional<double> height_m;
  TimeMap time;
  TriadMap gyro;
  TriadMap accelerometer;
  GimbalMap gimbal;
  std::vector<ColumnRef> temperature;
  std::string temperature_unit = "C";
  std::vector<std::string> unsettled;  // what only somebody who knows the instrument can say

  // For error messages.
  std::string name;
  std::map<std::string, std::size_t, std::less<>> lines;  // of each key, "gyro.unit"
  Error error_at(std::string_view key, std::string_view what) const;
};

// Strict: unknown tables and keys, wrong types, unknown units are errors with file and line.
Expected<ImportMap> parse_import_map(std::string_view toml, const std::string& name);

// The map as a commented file. REMARKS by key ("gyro.unit", "site") become comments above their lines.
std::string format_import_map(const ImportMap& map, const std::multimap<std::string, std::string>& remarks,
                              std::string_view heading);

}  // namespace selfcal::import
