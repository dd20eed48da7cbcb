// A model named on one recording, tried on another of the same unit that had no part in the fit.
#pragma once

#include <array>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::diagnosis {

struct HeldOutState {
  double log_likelihood = 0.0;  // of the second recording's innovations; the 24 free, the effects as found
  double nis = 0.0;             // per degree of freedom
  double log_p_white = 0.0;
  double parameter_disagreement = 0.0;  // of the 24 between both recordings: mean square in sigma, 1 expected where the
                                        // sensors' own errors stay (a new turn-on may give new biases)
};

struct Holdout {
  HeldOutState before, after;            // without and with the effects, the same noise model in both
  double gain = 0.0;                     // in log likelihood
  std::vector<std::string> not_carried;  // findings that belong to one recording only: motion of the base, noise
};

// Mean square of the differences over their variances, of the parameters that the first `determined`: where one is not seen
// half of its own prior is shared by both. 0 where none is.
double disagreement(const ParameterVector& first, const ParameterVector& first_sigma, const ParameterVector& second,
                    const ParameterVector& second_sigma, const std::array<bool, sensor_parameter_count>& determined);

struct HoldoutOutcome {
  std::optional<Holdout> holdout;
  std::string failure;
};

// `diagnosis` is that of the first recording; coefficients and constants are taken as they are, none is fitted anew.
HoldoutOutcome hold_out(const Diagnosis& diagnosis, const ImuData& second, const DiagnosisOptions& options);

}  // namespace selfcal::diagnosis
