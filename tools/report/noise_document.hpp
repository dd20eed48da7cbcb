// The Allan deviation of a recording and the noise terms that it shows, as the page holds them.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "protocol/recording/recording.hpp"

namespace selfcal::report {

// {"tau_s": [...], "gyro_deg_per_h": [x, y, z], "accel_ug": [x, y, z], "relative_sigma": [...] (of a deviation),
// "sensors": [{"sensor", "misfit", "known": [{"kind", "name", "unit"}...], "terms": [{"kind", "name", "value", "sigma",
// "unit", "slope", "at_one_second"}...]}...6]}. "at_one_second" is the term's Allan deviation at 1 s in the unit of the
// curve, "slope" the exponent of tau; "known" are the five terms that could be there, "terms" those that are.
nlohmann::ordered_json noise_document(const Recording& recording);

}  // namespace selfcal::report
