// A result in three sentences: the verdict, its cause, and what to do next. The same in every place that tells a
// result: `estimate`, `diagnose`, `run`, `show`, `amend`, the journal, LCM and the page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/estimate/gate.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal {

enum class Standing {
  good,  // may be used as it is
  bad,   // may not be used as it is
  open,  // nothing is concluded yet
};

struct Summary {
  Standing standing = Standing::open;
  std::string verdict;  // a sentence
  std::string cause;    // a sentence with the number that shows it; empty where there is none to give
  std::string next;     // a command, or a sentence; empty: nothing is left to do
};

// What the commands of `next` are about: a file, and the run that it belongs to (0: none).
struct Subject {
  std::string recording;
  long long run = 0;
};

// Of the 24. `diagnosis`, where there is one of the same recording, names the cause of an inconsistency.
Summary summary_of(const CalibrationResult& result, const Gate& gate, const Subject& subject,
                   const diagnosis::Diagnosis* diagnosis = nullptr);

// Of the 24 as fitted together with what `diagnosis` named.
Summary summary_of_amended(const CalibrationResult& result, const Gate& gate, const Subject& subject,
                           const diagnosis::Diagnosis& diagnosis);

// Of the question whether a recording holds physics beyond the model.
Summary summary_of(const diagnosis::Diagnosis& diagnosis, const Subject& subject);

std::string_view name(Standing standing);

// {"standing": "good" | "bad" | "open", "verdict", "cause", "next"}
nlohmann::ordered_json summary_json(const Summary& summary);
Summary read_summary(const nlohmann::ordered_json& json);  // empty strings where something is missing

// For people: verdict, cause and next, each broken to `columns` (0: not broken) with its later lines indented. Verdict and
// cause take `most_lines` at most (0: as many as they need) and are cut with "..."; what to do next is never cut.
std::string summary_text(const Summary& summary, bool colour, int columns = 0, int most_lines = 0);

}  // namespace selfcal
