// The diagnosis for scripts and for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::cli {

std::string verdict_name(diagnosis::DiagnosisVerdict verdict);
nlohmann::ordered_json diagnosis_json(const diagnosis::Diagnosis& diagnosis, double false_alarm_rate);
std::string diagnosis_text(const diagnosis::Diagnosis& diagnosis);
// Physics file (sim_ins/physics_file.cpp) with what was named; effects that such a file cannot hold become comments.
std::string physics_text(const diagnosis::Diagnosis& diagnosis);

}  // namespace selfcal::cli
