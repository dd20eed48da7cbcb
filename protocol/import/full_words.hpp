// Readings in words of 16 bits.
#pragma once

#include <string>
#include <vector>

#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"

namespace selfcal::import {

bool all_whole(const std::vector<double>& values);

// Whole numbers that leap by nearly 2^16 between two rows, as words of 16 bits do that are written without their sign, or are full in a fast
// turn: continued, so that they lie about zero. True: it was done. What stands at the ends of a range clips, and is left as it is.
bool continue_full_words(std::vector<double>& values);

// Of all columns but those that their names call a time, a counter or nothing of use. Words on which; empty: none.
std::string continue_full_columns(const ColumnSource& source, const std::vector<NamedColumn>& named,
                                  std::vector<std::vector<double>>& values);

}  // namespace selfcal::import
