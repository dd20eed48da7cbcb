// The run around a calibration: what the daemon tells of it (protocol/operator_api), put into the page's document.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "protocol/error.hpp"

namespace selfcal::report {

// A document of the daemon (`selfcal show RUN --json`, `selfcal history SERIAL --json`) as JSON; bad_input names
// `source` and the key that is missing.
Expected<nlohmann::ordered_json> read_run(const std::string& text, const std::string& source);
Expected<nlohmann::ordered_json> read_history(const std::string& text, const std::string& source);

// What `selfcal investigate --json` said, as the document of its page; nothing where the text is another document. bad_input names
// the key that is missing.
Expected<std::optional<nlohmann::ordered_json>> read_investigation(const std::string& text, const std::string& source);
// The same of what `poses --json` said, or `diagnose --json` of a recording that is judged so.
Expected<std::optional<nlohmann::ordered_json>> read_poses(const std::string& text, const std::string& source);

// The document of the run's page. The run's own result counts; `recomputed` (calibration_document() of its recording,
// nothing where the recording is gone) adds the curves to it.
nlohmann::ordered_json run_page_document(const nlohmann::ordered_json& run,
                                         const std::optional<nlohmann::ordered_json>& recomputed);

// Adds the unit's history, and to every parameter its change since the last calibration before `utc` (ISO 8601, as the
// history writes it; empty: the last of all), with the sigma of the difference of two independent values.
void add_history(nlohmann::ordered_json& document, const nlohmann::ordered_json& history, const std::string& utc);

}  // namespace selfcal::report
