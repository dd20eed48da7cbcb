// The answer of a log that stands, for people and as a document. Part of what `poses` answers.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/poses/rest.hpp"

namespace selfcal::cli {

nlohmann::ordered_json rest_json(const diagnosis::Rest& rest);
std::string rest_text(const diagnosis::Rest& rest);  // blocks, then both of these
std::string rest_table(const diagnosis::Rest& rest);
std::string rest_findings(const diagnosis::Rest& rest);
// Whether anything changes beyond noise.
bool drifts(const diagnosis::Rest& rest);

}  // namespace selfcal::cli
