// Equations of time and temperature beside the slow noise of a log that stands. Private to this folder.
//
// Asked are the catalogue's equations that change while nothing turns, found by their columns: steadily in time, warming up with a
// time constant, with the measured temperature; besides that temperature's rate and, once it is named, its square. What cannot be
// told from another one as long as nothing turns (bias and scale factor of an axis along gravity) is asked once. A bias may jump more
// than once.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/rest.hpp"
#include "estimator/diagnosis/poses/rest_blocks.hpp"

namespace selfcal::diagnosis {

// Fills mean, walk and terms of the axes; terms where drift is asked about.
void judge_drift(const RestBlocks& blocks, double alpha, std::vector<RestAxis>& axes);
// Whether there are blocks enough.
bool drift_is_asked(const RestBlocks& blocks);

}  // namespace selfcal::diagnosis
