// The diagnosis as a JSON document (`selfcal diagnose --json`; the daemon keeps it with an amended run). Its schema:
// protocol/document/schemas/diagnosis.schema.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/diagnosis.hpp"
#include "protocol/document/document_head.hpp"

namespace selfcal {

std::string verdict_name(diagnosis::DiagnosisVerdict verdict);
nlohmann::ordered_json diagnosis_json(const diagnosis::Diagnosis& diagnosis, double false_alarm_rate,
                                      const document::InputFile& input = {});

}  // namespace selfcal
