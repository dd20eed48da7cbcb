// Is the answer consistent with its own model? Figures and a verdict in words.
#pragma once

#include "estimator/models/segments.hpp"
#include "estimator/passes/calibration.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal {

// Innovations of the final pass.
Consistency judge_innovations(const PassOutput& pass, bool converged, double parity_max_sigma, bool noise_given);

std::vector<SegmentSummary> summarise_segments(const std::vector<Segment>& segments, const PassOutput& pass);

// Directions in parameter space, scaled by the tolerances, whose sigma is above 1; without remedies.
std::vector<UndeterminedDirection> undetermined_directions(const ParameterMatrix& covariance,
                                                           const ParameterVector& tolerance);

// What follows from value, sigma and covariance: which parameters are determined and possible, which directions are open.
void judge_parameters(CalibrationResult& result, const ParameterVector& tolerance);

}  // namespace selfcal
