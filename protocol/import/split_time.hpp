// Whole seconds in one column, the part of a second in the next: "secs, nsecs", "Unix Time, Microseconds".
#pragma once

#include <memory>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// The same columns, of which that of the seconds holds both; SOURCE itself where there are none, or the part is none of a second.
std::unique_ptr<ColumnSource> with_whole_time(std::unique_ptr<ColumnSource> source);

}  // namespace selfcal::import
