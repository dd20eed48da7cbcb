// Angles that are read one after the other.
#pragma once

#include <vector>

namespace selfcal {

// Read-outs that begin again after a full turn as one angle, rad: none turns by more than half a turn from the one before. What never
// begins again keeps its bits.
std::vector<double> unwrapped(std::vector<double> angle);

}  // namespace selfcal
