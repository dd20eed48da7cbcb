// Several recordings of one unit looked at together: for people, for programs, and for the set of an amendment.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/joint_fit.hpp"
#include "estimator/discovery/named_effects.hpp"
#include "estimator/discovery/next_experiment.hpp"
#include "estimator/discovery/shared_parameters.hpp"
#include "protocol/document/document_head.hpp"

namespace selfcal {

// A recording with its diagnosis. All must outlive it.
struct DiagnosedFile {
  const document::InputFile& file;
  const ImuData& data;
  const diagnosis::Diagnosis& diagnosis;
};
std::vector<discovery::DiagnosedRecording> recordings_of(std::span<const DiagnosedFile> files);

// What several recordings of one unit share, and what the catalogue says of each of them.
struct Together {
  struct Recording {
    document::InputFile file;
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::adequate;
    std::vector<std::string> names;
  };
  std::vector<Recording> recordings;   // the first is the one that the document is about
  std::vector<std::string> taken_out;  // effects that were named and are taken out of the recordings
  discovery::SharedParameters shared;  // with the effects and laws fitted beside
};

// Named effects and the laws of `found` fitted together, with the 24 that the recordings share; `found` has its coefficients from there
// afterwards, and without a process beside them the names in `first` have theirs, the diagnosis of the first recording. None for one recording
// that has not both. The failure is that of a calibration, or "stopped".
tl::expected<std::optional<discovery::JointFit>, std::string> fit_together(const discovery::UnexplainedRest& rest,
                                                                           discovery::Discovery& found,
                                                                           diagnosis::Diagnosis& first,
                                                                           const std::stop_token& stop = {});

Together put_together(std::span<const DiagnosedFile> recordings, const discovery::UnexplainedRest& rest,
                      const discovery::JointFit& joint);

// The experiment for the law whose closest rival is nearest now, told or unsure.
std::optional<discovery::NextExperiment> plan_next(std::span<const discovery::UnitRecording> unit,
                                                   const discovery::Discovery& found,
                                                   const discovery::ExperimentLimits& limits,
                                                   const std::stop_token& stop = {});

nlohmann::ordered_json together_json(const Together& together);
// For people; of an effect's coefficient, or of its constant behind them.
std::string name_of_coefficient(const diagnosis::Effect& effect, int coefficient);
// "fitted_effects" of the document: the effects of the joint fit.
nlohmann::ordered_json fitted_effects_json(const discovery::JointFit& joint);
// "next_experiment" of the document, where there is one.
void add_next_experiment(nlohmann::ordered_json& document, const std::optional<discovery::NextExperiment>& next);

}  // namespace selfcal
