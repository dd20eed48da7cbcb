// What an attitude shows of a log: words and JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/poses/attitude.hpp"
#include "tools/cli/poses_words.hpp"

namespace selfcal::cli {

std::string attitude_text(const diagnosis::ByAttitude& d, const ReadingUnits& shown);
nlohmann::ordered_json attitude_json(const diagnosis::ByAttitude& d);

}  // namespace selfcal::cli
