// Noise of a still base, of the greatest likelihood of the navigation's drift.
//
// For recordings whose spectra mislead: a coarse quantum, dither and vibration fill the bands in which the densities are
// read, and do not reach the second-by-second drift that the filter sees. Equations (M1)-(M3) of estimator/README.md with
// a random walk of position (motion_model.hpp) as the base's motion.
#pragma once

#include <vector>

#include "estimator/passes/drift_series.hpp"

namespace selfcal {

struct StillNoise {
  double gyro_arw = 0.0;                    // rad/s/sqrt(Hz)
  double accel_vrw = 0.0;                   // m/s^2/sqrt(Hz)
  double position_sigma = 0.0;              // m, white, at 1 Hz
  Vector3 position_walk = Vector3::Zero();  // m/sqrt(s), north, up, east: white noise of the accelerometers' integral
};

struct StillNoiseFit {
  StillNoise noise;
  std::vector<Disturbance> disturbed;  // seconds that the rest's noise cannot make, chronological
};

// From `start` (all positive) by steps of a factor down to 3 %. A second counts as disturbed where its three innovations would come by
// chance once in 10^6 (chi-squared with 3 degrees: 30.7) and weighs as much less; at most a tenth of all: where it is more
// the noise is not what is wrong, and none is.
StillNoiseFit fit_still_noise(DriftSeries series, const StillNoise& start);

}  // namespace selfcal
