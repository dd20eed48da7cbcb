// Which extra positions would supply what a recording or a schedule did not determine.
#pragma once

#include <vector>

#include "estimator/planning/plan.hpp"

namespace selfcal {

// For each direction: every turn of one axis by 90 deg within the gimbal's circle, with a dwell on both sides, is put
// after what is known (`covariance` of the 24, SI) by the filter itself, nothing being known of attitude. The best few
// go into `supply`, most informative first, and into `words`. Turns that take less than a tenth off sigma do not count.
void add_remedies(std::vector<UndeterminedDirection>& directions, const ParameterMatrix& covariance,
                  const Installation& installation);

// The installation of a recording that has been calibrated, for the above.
Installation installation_of(const CalibrationResult& result, const earth::Position& site,
                             const ParameterVector& tolerance);

}  // namespace selfcal
