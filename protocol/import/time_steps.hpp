// What a time does that is no fault of the sensor: clocks that begin again at their end, rows that were written twice.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// Of two stamps and more, in their unit.
long double median_interval(const std::vector<long double>& stamps);

// Clocks and counters that begin again where they are full: 2^16, 2^24, 2^32 ticks, a day or a GPS week in s or ms. Where a stamp falls by
// so much that with one of these added it is the usual interval behind the one before, or up to twenty where it falls to its beginning, it goes on
// from there. So does a second that stands twice, as a leap second does in UTC, where that is the only fall. Words on where; empty: nowhere.
std::string continue_full_clocks(std::vector<long double>& stamps);

// A clock coarser than the rows, or one of blocks of rows: stamps that never fall and stand still for a few rows are spread evenly up to the next
// one. Words on how many; empty: nothing done, for fewer than one in a hundred stands still, or one does for long. However long where each stamp
// but the first and the last has as many rows: whole seconds, of which one alone with twice as many is two, as a leap second is in UTC.
std::string spread_coarse_stamps(std::vector<long double>& stamps);
// A log that was begun anew for each part, a position say, with a time that begins where it began first: the parts one behind the other, a gap of
// 6000 intervals between them. Words on how many; empty: nothing done, for the time falls to elsewhere, or two parts have as many rows, as two
// sensors' have.
std::string put_parts_behind(std::vector<long double>& stamps);
// Rows that came by a network, a few of them by another way than those before: put in the order of their stamps where one in fifty and fewer stands
// up to eight rows behind its place. Words on how many; empty: nothing done.
std::string put_in_order(ColumnData& data);
std::string put_in_order(std::vector<long double>& stamps);  // alone
// For each row the number of rows before it with the same stamp.
std::vector<int> place_in_stamp(const std::vector<long double>& stamps);

// True for a row that is the one before in its stamp and in all values: written twice. None where more than a tenth of all rows are.
std::vector<bool> repeated_rows(const ColumnData& data);

// Rows of a file that nothing is judged by.
struct LeftOutRows {
  std::vector<bool> rows;
  std::ptrdiff_t incomplete = 0,
                 repeated = 0;  // that lack a number (incomplete_rows.hpp), that are the row before once more
};
// Of tolerantly read data without stamps. A row is taken for one written twice only where another column goes on from row to row: the
// counts of a coarse sensor that rests are the same again as well.
LeftOutRows rows_to_leave_out(const ColumnData& data, double most_incomplete);

}  // namespace selfcal::import
