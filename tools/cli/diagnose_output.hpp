// The diagnosis for scripts and for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::cli {

std::string verdict_name(diagnosis::DiagnosisVerdict verdict);
nlohmann::ordered_json diagnosis_json(const diagnosis::Diagnosis& diagnosis, double false_alarm_rate);
std::string diagnosis_text(const diagnosis::Diagnosis& diagnosis);

}  // namespace selfcal::cli
