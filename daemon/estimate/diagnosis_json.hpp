// The diagnosis as a JSON document (`selfcal diagnose --json`; the daemon keeps it with an amended run). Its schema:
// protocol/document/schemas/diagnosis.schema.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/estimate/summary.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "protocol/document/document_head.hpp"

namespace selfcal {

std::string verdict_name(diagnosis::DiagnosisVerdict verdict);
// `input` is the recording's file, and what the commands of the summary name; without one there is no summary. `beyond`: what
// was found where the catalogue explains nothing.
nlohmann::ordered_json diagnosis_json(const diagnosis::Diagnosis& diagnosis, double false_alarm_rate,
                                      const document::InputFile& input = {},
                                      const discovery::Discovery* beyond = nullptr);

}  // namespace selfcal
