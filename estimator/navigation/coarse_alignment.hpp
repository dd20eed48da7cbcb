// Coarse alignment in the inertial frame: any attitude, still or moored base, no guess needed.
#pragma once

#include "estimator/models/imu_data.hpp"

namespace selfcal {

struct CoarseAlignment {
  Matrix3 C_nb;                  // at the start of the first sample
  double span_s = 0.0;           // of data used
  double gravity = 0.0;          // found, m/s^2
  double horizontal_rate = 0.0;  // Omega cos L found, rad/s: against the site's, a measure of success
};

// Seen from inertial space the specific force of a base at rest turns with the Earth: in the frame b0 in which b stood
// at the start, f(t) = g (u + t Omega cos L e + ...) with u up and e east at the start [eq. (A1)]. The integral of the
// measured specific force, carried into b0 by the gyros, is fitted with a quadratic in t under a window that is zero at
// both ends, so that bounded motion of the base (sway, heave) averages out as its square.
// `span_s`: how much of the start of the recording to use.
CoarseAlignment coarse_alignment(const ImuData& data, double span_s);

}  // namespace selfcal
