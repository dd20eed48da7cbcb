// What a discovery found, for people, for programs, and as a file of laws.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/estimate/unit_answer.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_trial.hpp"
#include "estimator/discovery/next_experiment.hpp"
#include "protocol/law_file/law_file.hpp"

namespace selfcal::cli {

// What was found, or all that was tried besides and every rival.
enum class Detail { brief, full };

std::string together_text(const Together& together);
// Named effects fitted together on all recordings, and beside the laws. Empty where none was.
std::string effects_text(const discovery::JointFit& joint);
std::string discovery_text(const discovery::Discovery& found, const std::optional<discovery::NextExperiment>& next,
                           Detail detail);
std::string trial_text(const std::vector<discovery::TriedLaw>& tried);
nlohmann::ordered_json trial_json(const std::vector<discovery::TriedLaw>& tried);
std::vector<LawText> laws_of(const discovery::Discovery& found);

}  // namespace selfcal::cli
