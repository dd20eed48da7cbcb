// The diagnosis as the JSON document of interfaces.md (`selfcal diagnose --json`; the daemon keeps it with an amended
// run).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal {

std::string verdict_name(diagnosis::DiagnosisVerdict verdict);
nlohmann::ordered_json diagnosis_json(const diagnosis::Diagnosis& diagnosis, double false_alarm_rate);

}  // namespace selfcal
