// Seconds in which the base is shaken: by people, wind, a knock. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

// Seconds of the dwells that are far louder than their like, in time's order; none where more than a tenth are, for then the
// recording is so. The gyros measure such motion; that the position stands still is what is wrong.
std::vector<FaultyStretch> find_disturbed(const ImuData& data, const std::vector<Segment>& segments);

}  // namespace selfcal::diagnosis
