// Single samples that no motion makes, and outputs that are clipped. Private to this folder.
#pragma once

#include <vector>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

// Single samples far from their neighbours in dwells. A base that is shaken gives such samples as well: motion rings on in
// the neighbouring samples, or shows in both triads; a spike does neither. Appends.
void find_spikes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults);

// Extreme values that are met again and again, in the recording or in one turn. Appends.
void find_saturation(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults);

}  // namespace selfcal::diagnosis
