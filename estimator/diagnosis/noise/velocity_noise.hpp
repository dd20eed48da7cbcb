// White noise of the accelerometers' integral (a coarse quantum, dither that leaks through): a random walk of position
// that the calibration's filter does not have, and takes for white noise of force and of the base.
#pragma once

#include <array>
#include <functional>
#include <optional>

#include "estimator/diagnosis/noise/noise_check.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

// Of angle (rad/sqrt(s)), of velocity (m/s/sqrt(s)), and of position, which walks with the integral's noise (m/sqrt(s)).
using NoiseDensities = std::array<double, 3>;
NoiseModel with_velocity_noise(NoiseModel noise, const NoiseDensities& densities);

// Where it is large enough to colour the innovations it becomes a walk of the position observed (exactly its effect on
// a filter that observes nothing else), and all densities those of the greatest likelihood, to 3 %. True where `input`
// changed.
bool fit_velocity_noise(PassInput& input, const NoiseCheck& noise);

// The densities that were fitted before anything was named hold what was left out, shared among them as it fits best: beside
// the names they are fitted again, from where they are, to `log_likelihood`. None where there is no such walk, or it is at the top
// already.
std::optional<NoiseModel> refit_velocity_noise(const NoiseModel& noise,
                                               const std::function<double(const NoiseModel&)>& log_likelihood);

}  // namespace selfcal::diagnosis
