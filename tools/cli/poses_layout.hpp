// Which columns of a log hold what `selfcal poses` reads, by their names or by where they stand.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"

namespace selfcal::cli {

// What the caller says of a log.
struct RawColumns {
  std::optional<diagnosis::Sensors> sensors;  // none: both, or the triad that alone has a name
  std::optional<double> rate_hz;              // of its rows; no column is a time then
  std::size_t angle = 0;                      // a table's angle: its column, from 1; 0: none is told
  std::size_t turn_rate = 0;                  // a table's rate, likewise
  bool table_by_names = true;                 // where neither is told, as names call them
  std::size_t temperature = 0;                // its column, from 1, in degC; 0: none
  bool raw_gyros = false;                     // the caller knows their unit: as they are
  std::string gyros, accelerometers;          // their columns as an option lists them; empty: by their names
};

struct PoseLayout {
  diagnosis::Sensors sensors = diagnosis::Sensors::both;
  std::vector<std::size_t> times;        // columns that may be the time, best first; none: the rate is given
  std::vector<std::size_t> gyro, accel;  // x, y, z; gyros alone may be one axis; empty: not read
  int only_axis = -1;                    // of one axis alone: which it is, x where no name says it
  bool by_names = false;
  bool names_unread = false;  // there are names, and none says what a column is
  std::string notes;          // which of several sets
};

// Errors (bad_input): names that say another thing than three gyros and three accelerometers, too few columns.
Expected<PoseLayout> pose_layout(const import::ColumnSource& source, const std::vector<import::NamedColumn>& named,
                                 const RawColumns& columns, const std::string& file);

// "by the names time is column 1 in ms, gyros are 2, 3, 4"; empty: all stands in the order that the handbook states.
std::string layout_words(const PoseLayout& layout, std::size_t time, const std::string& unit_of_time,
                         const RawColumns& columns);

}  // namespace selfcal::cli
