// Order statistics of values that are there: an empty vector has none.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace selfcal {

// The value that `share` of the others (0 to 1) lie below, none between two.
inline double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Of an even number of values the upper one of the middle two.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace selfcal
