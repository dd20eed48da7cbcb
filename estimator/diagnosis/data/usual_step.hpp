// What an axis changes by from one sample to the next. Private to this folder.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {

// Median of the changes into samples [first, last) that change: the quantum where it is coarse, else about the noise. Infinite where
// nothing changes. `value(i)`: of sample i.
template <typename Value>
double usual_step(std::size_t first, std::size_t last, const Value& value) {
  std::vector<double> steps;
  for (std::size_t i = first; i < last; ++i) {
    if (value(i) != value(i - 1)) {
      steps.push_back(std::abs(value(i) - value(i - 1)));
    }
  }
  return steps.empty() ? HUGE_VAL : median(std::move(steps));
}

}  // namespace selfcal::diagnosis
