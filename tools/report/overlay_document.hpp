// An overlay as its page holds it, and as lines for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/report/overlay.hpp"

namespace selfcal::report {

// {"kind": "overlay", "summary", "input", "against", "judgements", "curves"}. `names`: of the files.
nlohmann::ordered_json overlay_document(const Overlay& overlay, const std::string& recording,
                                        const std::string& simulation);
std::string overlay_text(const Overlay& overlay);

}  // namespace selfcal::report
