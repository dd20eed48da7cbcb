// Rows that lack a number (NaN, an empty field, a last line that was cut off): samples that were lost.
#pragma once

#include <vector>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// One a row of tolerantly read data: true where a value or the time is no finite number. A column of which more than `most` of the rows
// have none does not count: it is no sensor's.
std::vector<bool> incomplete_rows(const ColumnData& data, double most);

// Takes these rows out. What ColumnData::place() says of a text stays right.
void leave_out(const std::vector<bool>& rows, ColumnData& data);

}  // namespace selfcal::import
