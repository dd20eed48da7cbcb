// What a discovery found, for people, for programs, and as a file of laws.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_trial.hpp"
#include "estimator/discovery/next_experiment.hpp"
#include "estimator/discovery/shared_parameters.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/law_file/law_file.hpp"

namespace selfcal::cli {

// What several recordings of one unit share, and what the catalogue says of each of them.
struct Together {
  struct Recording {
    document::InputFile file;
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::adequate;
    std::vector<std::string> names;
  };
  std::vector<Recording> recordings;   // the first is the one that the document is about
  std::vector<std::string> taken_out;  // effects that were named and are taken out of the recordings
  discovery::SharedParameters shared;
};

std::string together_text(const Together& together);
nlohmann::ordered_json together_json(const Together& together);
std::string discovery_text(const discovery::Discovery& found, const std::optional<discovery::NextExperiment>& next);
// "next_experiment" of the document, where there is one.
void add_next_experiment(nlohmann::ordered_json& document, const std::optional<discovery::NextExperiment>& next);
std::string trial_text(const std::vector<discovery::TriedLaw>& tried);
nlohmann::ordered_json trial_json(const std::vector<discovery::TriedLaw>& tried);
std::vector<LawText> laws_of(const discovery::Discovery& found);

}  // namespace selfcal::cli
