// Axes that do not answer: one value for longer than chance makes, while the others of their triad move. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {

struct StuckAxis {
  bool gyro = true;
  int axis = 0;
  std::size_t first = 0, last = 0;  // samples
  bool throughout = false;          // in the whole log
};

std::vector<StuckAxis> find_stuck(const PoseInput& input);

// Of an axis that reads one value in the whole log nothing is told, and gravity needs all three: into `gyro_axes`, `invisible`, `failure`.
void add_dead_axes(const std::vector<StuckAxis>& stuck, PoseDiagnosis& d);

}  // namespace selfcal::diagnosis
