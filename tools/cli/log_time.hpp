// The time of a log that is read as columns.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"

namespace selfcal::cli {

struct TimedRows {
  import::ColumnData data;
  std::size_t time = 0;  // the column that its stamps are of
  std::string notes;     // what was done to them; empty: nothing
};

// Whether a column holds a time anywhere in the first rows.
bool holds_stamps(const import::ColumnSource& source, std::size_t column);

// With the first of the columns `times` whose stamps rise, or else with the first that can be read: a date of the day stands beside the time of
// the day. Rows that stand twice are taken once, a few
// that stand behind later ones are put in order, clocks that begin again where they are full go on, and where the request is tolerant rows
// without a time are left out. No `times`: no stamps.
Expected<TimedRows> read_with_time(const import::ColumnSource& source, std::vector<std::size_t> times,
                                   import::ColumnRequest request);

// A time that no name gives a unit is seconds, unless these make less than a sample a second and one other unit makes a usual rate. Error
// (bad_input): several others do; `way_out` says what to do then.
Expected<std::string> time_unit(const TimedRows& rows, const import::ColumnSource& source,
                                const std::vector<import::NamedColumn>& named, const std::string& file,
                                const std::string& way_out);

// Error (bad_input): the place of the first time that does not increase, with `way_out` behind it.
Expected<void> check_increasing(const std::string& file, const import::ColumnData& data, const std::string& way_out);

}  // namespace selfcal::cli
