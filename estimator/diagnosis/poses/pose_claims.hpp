// Columns that are called a sensor's and hold something else. Private to this folder.
#pragma once

#include <string>

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {

// In words, what the series are instead of readings; empty: nothing contradicts. Accelerometers that were added up (differences from row to row have one
// size, gravity's, while the sums go far); that were divided by their size (their size has no noise, their direction has); gyros that are angles (they tell
// of tens of degrees a second across a gravity that stands still).
std::string no_readings(const PoseInput& input);

}  // namespace selfcal::diagnosis
