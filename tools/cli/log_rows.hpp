// Rows of a log that lack some of their numbers.
#pragma once

#include "tools/cli/log_time.hpp"
#include "tools/cli/poses_layout.hpp"

namespace selfcal::cli {

// Rows of tolerantly read columns, in the order of `layout`: gyros, accelerometers, others. Where few lack a number these are left out. Where
// gyros and accelerometers have rates of their own, the fields between them empty, each row of the slower triad gets the mean of the faster one
// since the row before, which keeps what the gyros turned by. What was done stands in `rows.notes`. False: too little is left.
bool fill_incomplete(const PoseLayout& layout, TimedRows& rows);

}  // namespace selfcal::cli
