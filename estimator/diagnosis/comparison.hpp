// Two recordings of the same schedule, one of them usually simulated: where they differ, and by which physics.
//
// With r = Z theta + noise the whitened innovations of either (see signature_pass.hpp), the scaled difference
// (r - r')/sqrt(2) is one unit-noise regression on the columns Z/sqrt(2) whose coefficients are how far the first
// exceeds the second. Both are filtered alike, with the mean of their noise: then the difference of the innovations is the
// innovation of the difference, and what both hold alike drops out. Effects that differ are named as in a diagnosis: taken
// out of the recording, the 24 settled, compared again until their sizes stand still.
//
// What both hold drops out only as far as they stood alike (Z = Z'). Effects that the simulation shows by itself are
// therefore taken out of both first, the same sizes from each along its own attitudes: theta - theta' stays what it was.
#pragma once

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::diagnosis {

struct Comparison {
  Diagnosis diagnosis;  // located, findings, adequacy of the difference; the 24 and calibration the recording's
  std::vector<Finding> in_both;  // effects that the simulation shows, taken out of both before they were compared
  ParameterVector difference;    // of the 24, recording less simulation, SI, findings taken into account
  ParameterVector sigma;
  double attitude_difference = 0.0;  // largest between the two in a dwell, rad
};

struct ComparisonOutcome {
  std::optional<Comparison> comparison;
  std::string failure;  // schedules that differ, or a recording that cannot be calibrated
};

ComparisonOutcome compare(const ImuData& recording, const ImuData& simulation, const DiagnosisOptions& options,
                          const std::function<void(const std::string&)>& progress = {});

}  // namespace selfcal::diagnosis
