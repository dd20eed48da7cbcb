// Coloured motion of a moored base: an autoregressive model of the position residuals.
#pragma once

#include <Eigen/Core>
#include <array>

#include "estimator/passes/pass.hpp"

namespace selfcal {

// One set of coefficients for the three axes, each with its own drive: the axes see the same swell, and a line that is
// weak in one of them is strong in another. Least squares on forward and backward prediction errors (the modified
// covariance method; S. L. Marple, Digital Spectral Analysis, 1987, ch. 8: unlike Burg's, without bias of frequency or
// damping on sinusoids), each axis weighted by its own prediction error. What is slower than about a minute is taken
// out first: it is the wander of the filter that watched, not motion of the base. Poles outside the unit circle are
// drawn back onto radius 0.99999. series: [epochs x (north, up, east)], equally spaced in time, in m; at least 4 order
// epochs.
std::array<MotionModel, 3> fit_motion(const Eigen::Matrix<double, Eigen::Dynamic, 3>& series, int order);

}  // namespace selfcal
