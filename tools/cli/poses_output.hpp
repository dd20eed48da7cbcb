// The answer of a recording that is judged by poses and read-outs, for people and as a document. `poses` and `diagnose`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"

namespace selfcal::cli {

nlohmann::ordered_json poses_json(const diagnosis::PoseDiagnosis& d);
// `si`: readings are rad/s and m/s^2, told in deg/s and mg; else in raw units. The summary has what is found first, then bias and scale
// factors, in some ten lines of 80 columns; the details have every test and every parameter.
std::string poses_summary(const diagnosis::PoseDiagnosis& d, bool si);
std::string poses_details(const diagnosis::PoseDiagnosis& d, bool si);
// Whether a rate table shows that a scale factor changes with the rate.
bool names_nonlinearity(const diagnosis::PoseDiagnosis& d);
// Whether something is there that bias, scale and misalignment do not hold.
bool poses_mismatch(const diagnosis::PoseDiagnosis& d);

}  // namespace selfcal::cli
