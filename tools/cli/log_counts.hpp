// What a logger counts: rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace selfcal::cli {

// Which row of the sensor each row of the log is, counted from 0, by a COUNTER that rises by the same from row to row, also one that begins again at
// 2^8, 2^16, 2^24 or 2^32: rows that were lost are left out of it. None: no counter, or one that does not rise so.
std::optional<std::vector<double>> rows_by_counter(const std::vector<double>& counter);

}  // namespace selfcal::cli
