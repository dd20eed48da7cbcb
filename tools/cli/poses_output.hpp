// The answer of a recording that is judged by poses and read-outs, for people and as a document. `poses` and `diagnose`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"

namespace selfcal::cli {

// `si`: readings are rad/s and m/s^2, told in deg/s and mg; else in raw units.
nlohmann::ordered_json poses_json(const diagnosis::PoseDiagnosis& d);
std::string poses_text(const diagnosis::PoseDiagnosis& d, bool si);
// Whether something is there that bias, scale and misalignment do not hold.
bool poses_mismatch(const diagnosis::PoseDiagnosis& d);

}  // namespace selfcal::cli
