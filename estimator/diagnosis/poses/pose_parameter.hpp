// A parameter of a triad as `poses` tells it.
#pragma once

#include <string>

namespace selfcal::diagnosis {

// A parameter of the accelerometers or of the gyros with what the poses leave open.
struct PoseParameter {
  std::string name, unit;
  double value = 0.0, sigma = 0.0;
  bool determined = false;  // sigma less than half of what was assumed before
};

}  // namespace selfcal::diagnosis
