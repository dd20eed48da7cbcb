// Coloured motion of a moored base: an autoregressive model of the position residuals.
#pragma once

#include <Eigen/Core>

#include "estimator/passes/pass.hpp"

namespace selfcal {

// Least squares on forward and backward prediction errors (the modified covariance method; S. L. Marple, Digital
// Spectral Analysis, 1987, ch. 8): unlike Burg's, without bias of frequency or damping on sinusoids. Poles outside the
// unit circle are drawn back onto radius 0.99999. The series is equally spaced in time, in m.
MotionModel fit_motion(const Eigen::VectorXd& series, int order);

}  // namespace selfcal
