// How one parameter of many units of a type varies, fitted over all of them at once: (F1) and (F2) of unit_filter.hpp.
//
// The variances and T maximise the restricted likelihood (REML: Patterson & Thompson, Biometrika 58, 1971), which a Kalman filter
// over each unit gives by its innovations (Harvey, Forecasting, Structural Time Series Models, 1989, 3.4); m, r0, v0 and b follow
// by generalised least squares on the same innovations. v is there where the data ask for it: where it raises the log likelihood by
// more than its four figures (AIC: Akaike, IEEE Trans. Autom. Control 19, 1974; the model is there to forecast).
#pragma once

#include <span>

#include "estimator/fleet/unit_filter.hpp"

namespace selfcal::fleet {

// Nothing can be told of a type from fewer than three units or ten measurements: all zero then but for the mean, and a unit_sd
// that covers what was seen.
TypeModel fit_type(std::span<const UnitHistory> units, int sets);

}  // namespace selfcal::fleet
