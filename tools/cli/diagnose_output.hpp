// The diagnosis for scripts and for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/estimate/summary.hpp"
#include "estimator/diagnosis/comparison.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/empirical.hpp"
#include "estimator/diagnosis/holdout.hpp"
#include "estimator/diagnosis/isolability.hpp"
#include "protocol/document/document_head.hpp"
#include "tools/cli/discovery_output.hpp"

namespace selfcal::cli {

// Verdict, cause and next step, broken to `columns` (0: not broken), then the figures: what was found and what it makes of the 24, or all
// that was tried and every place. `subject` is what the commands name, `beyond` what was found where the catalogue explains nothing.
std::string diagnosis_text(const diagnosis::Diagnosis& diagnosis, const Subject& subject, Detail detail, bool colour,
                           int columns, const discovery::Discovery* beyond = nullptr);
Summary summary_of_comparison(const diagnosis::Comparison& comparison);
// The fields of a diagnosis; "parameters" holds recording, simulation, difference and its sigma.
nlohmann::ordered_json comparison_json(const diagnosis::Comparison& comparison, double false_alarm_rate,
                                       const document::InputFile& recording);
std::string comparison_text(const diagnosis::Comparison& comparison);
nlohmann::ordered_json empirical_json(const diagnosis::EmpiricalDescription& description);
std::string empirical_text(const diagnosis::EmpiricalDescription& description);
nlohmann::ordered_json splits_json(const std::vector<diagnosis::Split>& splits);
std::string splits_text(const std::vector<diagnosis::Split>& splits);
nlohmann::ordered_json holdout_json(const diagnosis::Holdout& holdout);
std::string holdout_text(const diagnosis::Holdout& holdout);

}  // namespace selfcal::cli
