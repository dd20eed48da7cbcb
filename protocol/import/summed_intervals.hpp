// A column of intervals in the place of a time: "dt", "delta_t [ms]", "DeltaTime_us".
#pragma once

#include <memory>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// The same columns, of which that of the intervals holds their sum up to and with each row, in its unit: each row's interval lies before it. SOURCE
// itself where no column is called so and holds positive numbers of about one size, or another column rises from row to row as a time does.
std::unique_ptr<ColumnSource> with_summed_intervals(std::unique_ptr<ColumnSource> source);

}  // namespace selfcal::import
