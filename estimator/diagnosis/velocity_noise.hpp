// White noise of the accelerometers' integral (a coarse quantum, dither that leaks through): a random walk of position
// that the calibration's filter does not have, and takes for white noise of force and of the base.
#pragma once

#include "estimator/diagnosis/noise_check.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

// Where it is large enough to colour the innovations it becomes a walk of the position observed (exactly its effect on
// a filter that observes nothing else), and all densities those of the greatest likelihood. True where `input` changed.
bool fit_velocity_noise(PassInput& input, const NoiseCheck& noise);

}  // namespace selfcal::diagnosis
