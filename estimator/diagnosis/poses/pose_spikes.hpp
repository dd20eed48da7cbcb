// Single samples that no motion makes: a bit that flipped, a word of another register. Private to this folder.
#pragma once

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {

// Puts the mean of both neighbours in place of each reading that stands alone: eight times as far off them as they and the four beyond on either
// side differ from one another. How many those are.
std::size_t take_out_spikes(PoseInput& input);

}  // namespace selfcal::diagnosis
