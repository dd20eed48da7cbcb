// Whether the names are an explanation, and what they leave: what a verdict rests on beside map, whiteness and size.
#pragma once

#include <algorithm>
#include <vector>

#include "estimator/diagnosis/search/constants.hpp"
#include "estimator/diagnosis/search/locate.hpp"

namespace selfcal::diagnosis {

// Two terms of which the one can stand for half of the other and more: together they describe a curve, and are no explanation
// of it. Walks stand for what their triad's do. `named`: the terms of the model, with the amplitudes that count.
bool any_collinear(const LinearModel& model, const Hypothesis& named);

// Of the biases that dwells, rotations, times since a turn and times of the recording still show, axis by axis: the
// smallest p, corrected. A single one is the map's; this is what many together leave. `log_p_named`: where what is named
// makes at least as much as is left (a walk: anywhere in its triad); 0: nowhere.
struct Structure {
  double log_p_named = 0.0, log_p_elsewhere = 0.0;
  double log_p() const { return std::min(log_p_named, log_p_elsewhere); }
};
Structure structure_left(const Stage& stage);

// Of slow curves that drifts as named leave on their axes, and of functions of the gimbal angles that gyro drifts with the
// attitude leave on theirs: the smallest p, corrected. An effect that is named only because it is like the true one leaves some: a lack of fit. `named`: as for any_collinear.
double log_p_of_lack_of_fit(const RecordingContext& context, const Stage& stage, const WithConstants& with,
                            const Hypothesis& named);

// The map by gimbal angles, directions and temperature (quantities.hpp); takes no part in any verdict. One more pass.
struct ByQuantity {
  std::vector<Located> before, after;
};
ByQuantity locate_by_quantities(const RecordingContext& context, const Stage& stage);

}  // namespace selfcal::diagnosis
