// Words of 32 or 16 bits in two columns each: "X_GYRO_OUT, X_GYRO_LOW", "gx_msw, gx_lsw", "ACCEL_XOUT_H, ACCEL_XOUT_L".
#pragma once

#include <memory>
#include <string_view>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// Behind the name of a column that another one holds already.
constexpr std::string_view low_half = " (low half of a word)";

// The same columns, of which that of the high half holds the whole word. SOURCE itself where names tell no three pairs, or the numbers do not
// bear them out: where the high half changes, the low one either takes all values as often or leaps back.
std::unique_ptr<ColumnSource> with_whole_words(std::unique_ptr<ColumnSource> source);

}  // namespace selfcal::import
