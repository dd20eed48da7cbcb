// Fits the motion of a moored base: a few damped oscillations, of greatest likelihood.
#pragma once

#include "estimator/passes/drift_series.hpp"

namespace selfcal {

// Frequencies and decays are shared by the three axes (they see the same swell, and a line that is weak in one of them
// is strong in another); sizes are each axis's own, and the white noise of the position is common. Pure lines are taken
// one at a time where the periodogram of the innovations is highest, until what is left looks like noise, at most
// eight; then frequencies, decays and sizes are fitted together by Fisher scoring. Periods up to 60 s: what is slower is
// left to the wander that the filter of the navigation knows. `noise.white_sigma` is where the white noise starts.
// Equations (M1)-(M5) of estimator/README.md.
ObservationModel fit_motion(const DriftSeries& series, const DriftNoise& noise);

}  // namespace selfcal
