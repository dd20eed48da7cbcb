// The summaries of what the estimator answers (protocol/document/summary.hpp has their form).
#pragma once

#include <string>

#include "daemon/estimate/gate.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/passes/calibration.hpp"
#include "protocol/document/summary.hpp"

namespace selfcal {

// What the commands of `next` are about: a file, and the run that it belongs to (0: none).
struct Subject {
  std::string recording;
  long long run = 0;
};

// Of the 24. `diagnosis`, where there is one of the same recording, names the cause of an inconsistency; `beyond` is what the
// search found where the catalogue explains nothing.
Summary summary_of(const CalibrationResult& result, const Gate& gate, const Subject& subject,
                   const diagnosis::Diagnosis* diagnosis = nullptr, const discovery::Discovery* beyond = nullptr);

// Of the 24 as fitted together with what `diagnosis` named.
Summary summary_of_amended(const CalibrationResult& result, const Gate& gate, const Subject& subject,
                           const diagnosis::Diagnosis& diagnosis, const discovery::Discovery* beyond = nullptr);

// Of the question whether a recording holds physics beyond the model.
Summary summary_of(const diagnosis::Diagnosis& diagnosis, const Subject& subject,
                   const discovery::Discovery* beyond = nullptr);

// Whether the innovations are white, as far as that is judged: "white (p = 0.32)", "coloured by quantum and lines".
std::string innovations_text(const diagnosis::Adequacy& adequacy);

}  // namespace selfcal
