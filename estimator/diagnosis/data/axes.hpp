// What the sensors must agree on whatever their errors: turns with the gimbal, gravity with the turns, the angle between
// gravity and the Earth's rate with the site's latitude.
#pragma once

#include <vector>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

// wrong_axes, wrong_sign, wrong_scale, wrong_read_out, wrong_site; the last only where the axes are right. Appends. Which of
// gyros, accelerometers and read-outs is wrong is decided by which of them is the odd one out (data_attribution.hpp).
void find_wrong_axes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults);

// Whether a read-out spans more than two turns, as no gimbal does: degrees. Dwells are then found in the gyros.
bool read_outs_in_degrees(const ImuData& data);

}  // namespace selfcal::diagnosis
