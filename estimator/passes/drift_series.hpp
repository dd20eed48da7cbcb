// What a base held at rest by the navigation seems to do: the data to which the motion of a moored base is fitted.
#pragma once

#include <vector>

#include "estimator/passes/pass.hpp"

namespace selfcal {

// One element per whole update interval, in the order of the pass.
struct DriftSeries {
  double interval_s = 1.0;
  double sign = 1.0;                        // of the pass
  std::vector<Vector3> position, velocity;  // drive of the filter (N6), m and m/s
  std::vector<bool> turning;                // the gimbal turned
  std::vector<bool> coasted;                // without observation: position and velocity start anew
  std::vector<double> start_s, end_s;       // of the interval, chronological
  std::vector<double> inflation;            // of the noise's variance; empty: 1 everywhere
  std::size_t size() const { return position.size(); }
};

// Navigates the recording as the pass of `input` would, without its filter.
DriftSeries drift_series(const PassInput& input);

// Noise of one axis beside the motion of the base.
struct DriftNoise {
  double accel_vrw = 0.0;    // m/s^2/sqrt(Hz)
  double gyro_arw = 0.0;     // rad/s/sqrt(Hz): tilts the base, gravity makes an acceleration of it
  double white_sigma = 0.0;  // m, of the position
};

// Innovations of the position given those before, and their variances, for one axis.
struct AxisInnovations {
  Eigen::ArrayXd value, variance;  // m, m^2
  double log_likelihood = 0.0;     // less the constant
};

// Kalman filter of one axis, (M1)-(M3) of estimator/README.md: position, velocity and a wandering acceleration of the
// navigation, and the oscillations of the base. `axis`: 0 north, 1 up, 2 east.
void filter_axis(const DriftSeries& series, int axis, const DriftNoise& noise, const MotionModel& motion,
                 AxisInnovations& out);

}  // namespace selfcal
