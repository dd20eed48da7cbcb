// White noise of the accelerometers' integral (a coarse quantum, dither that leaks through): a random walk of position
// that the calibration's filter does not have, and takes for white noise of force and of the base.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "estimator/diagnosis/noise/noise_check.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

// Whether it is large enough to colour the innovations.
bool colours_innovations(const PassInput& input, const NoiseCheck& noise);

// Where it does, it becomes noise of the filter. Sensors with such noise are seldom alike (a dither leaks into one axis more than
// into another, a gyro ages): each axis has densities of its own, those of the greatest likelihood, to 3 %, and so has the noise
// in turns, whose lines no dwell tells, in proportion to that in dwells. True where `input` changed.
bool fit_velocity_noise(PassInput& input, const NoiseCheck& noise, const std::vector<Segment>& segments);

// The same, and the linearisation (parameters, attitude at the start) where forward and reverse passes in this noise end; noise and point in
// turns while the likelihood grows. The calibration weighed everything by densities that hold neither the quantum nor the lines (an angle
// random walk fifty times too large), and where its passes ended, or walked and were held, is not the top in other noise: 66 mrad of
// heading were within its sigma, and left 8 ug of the second order of a tilt. What stays open walks to no higher likelihood: it stays held.
bool fit_velocity_noise_and_point(PassInput& input, const NoiseCheck& check, const std::vector<Segment>& segments);

// The densities that were fitted before anything was named hold what was left out, shared among them as it fits best: beside
// the names they are fitted again, from where they are, to `log_likelihood`. None where there is no such noise, or it is at the top
// already.
std::optional<NoiseModel> refit_velocity_noise(const NoiseModel& noise,
                                               const std::function<double(const NoiseModel&)>& log_likelihood);

}  // namespace selfcal::diagnosis
