// A time of the day whose digits stand in one number: 235959.98, as NMEA's sentences write it.
#pragma once

#include <memory>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// The same columns, of which such a time is seconds of the day. SOURCE itself where no column begins as one and leaps by 40 from a minute to
// the next; a log that ends before that needs none.
std::unique_ptr<ColumnSource> with_clock_digits(std::unique_ptr<ColumnSource> source);

}  // namespace selfcal::import
