// What the page says first, where a document does not say it itself: those of programs before the summary was kept.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace selfcal::report {

// The run's own "summary", else the result's, else one from "acceptable", the consistency and how the run ended.
// Never better than the run: what was refused, broke off or failed does not stand as good, whatever its result says.
// `document` is a page's (run_page_document()), with or without a run.
nlohmann::ordered_json page_summary(const nlohmann::ordered_json& document);

// {"now": bool, "words": sentence}: whether the INS uses the run's set. True only where the run's document says so of
// now; a document that says only that the set was confirmed says it of the end of the run.
nlohmann::ordered_json force_of_run(const nlohmann::ordered_json& run);

}  // namespace selfcal::report
