// Rows of several sensors, one under another, that a number tells apart, or nothing but their stamps.
#pragma once

#include <string>
#include <vector>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// Whether rows of the same label are alike and neighbours of different labels are not, in two columns and more: as of two sensors with biases
// of their own, whose rows take turns.
bool rows_take_turns(const std::vector<std::vector<double>>& values, const std::vector<int>& labels);

// Words on the first column of two to eight small whole numbers that take turns in the first rows so ("I" of ArduPilot's IMUs); empty: none.
std::string numbered_rows(const ColumnSource& source);

}  // namespace selfcal::import
