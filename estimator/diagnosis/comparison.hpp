// Two recordings of the same schedule, one of them usually simulated: where they differ, and by which physics.
//
// Each is calibrated and filtered by itself. With r = Z theta + noise the whitened innovations of either (see
// signature_pass.hpp), the scaled difference (r - r')/sqrt(2) is one unit-noise regression on the columns Z/sqrt(2)
// whose coefficients are how far the first exceeds the second. What both hold alike drops out.
#pragma once

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::diagnosis {

struct Comparison {
  Diagnosis diagnosis;             // located, findings, adequacy of the difference; calibration is the recording's
  ParameterVector difference;      // of the 24, recording less simulation, SI, findings taken into account
  ParameterVector sigma;
  double attitude_difference = 0.0;   // largest between the two in a dwell, rad: columns are those of the recording
};

struct ComparisonOutcome {
  std::optional<Comparison> comparison;
  std::string failure;             // schedules that differ, or a recording that cannot be calibrated
};

ComparisonOutcome compare(const ImuData& recording, const ImuData& simulation, const DiagnosisOptions& options,
                          const std::function<void(const std::string&)>& progress = {});

}  // namespace selfcal::diagnosis
