// The time of a log that is read as columns.
#pragma once

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"

namespace selfcal::cli {

// Of the columns that are called a time the first that is one, with the other columns of REQUEST: a date of the day stands beside the time of the
// day. `time` becomes it.
Expected<import::ColumnData> read_with_time(const import::ColumnSource& source,
                                            const std::vector<import::NamedColumn>& named,
                                            import::ColumnRequest request, std::size_t& time);

// A time that no name gives a unit is seconds, unless these make less than a sample a second and another unit makes a usual rate.
std::string time_unit(const std::string& named, double interval);

// Error (bad_input): the place of the first time that does not increase.
Expected<void> check_increasing(const std::string& path, const import::ColumnData& data);

double interval_of(const import::ColumnData& data);

}  // namespace selfcal::cli
