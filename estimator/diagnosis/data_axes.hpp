// What the sensors must agree on whatever their errors: turns with the gimbal, gravity with the turns, the angle between
// gravity and the Earth's rate with the site's latitude.
#pragma once

#include <vector>

#include "estimator/diagnosis/data_faults.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

// wrong_axes, wrong_sign, wrong_scale, wrong_site; the last only where the axes are right. Appends.
void find_wrong_axes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults);

}  // namespace selfcal::diagnosis
