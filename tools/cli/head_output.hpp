// The answer of one accelerometer on a dividing head, for people and as a document.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/poses/dividing_head.hpp"

namespace selfcal::cli {

nlohmann::ordered_json head_json(const diagnosis::DividingHead& head);
// Some ten lines of 80 columns.
std::string head_text(const diagnosis::DividingHead& head);

}  // namespace selfcal::cli
