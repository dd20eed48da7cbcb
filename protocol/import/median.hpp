// The middle of values that are there.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace selfcal::import {

// Of an even number of values the upper one of the middle two. An empty vector has none.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace selfcal::import
