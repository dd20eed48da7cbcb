// Motion of the host the INS stands in: sums of sines about a mean attitude and the stated position.
#pragma once

#include <vector>

#include "estimator/geometry/rotation.hpp"

namespace selfcal::sim {

struct Sine {
  double amplitude = 0.0;  // rad or m
  double period_s = 1.0;
  double phase = 0.0;  // rad, at t = 0
};

// An exponential settling: amplitude * exp(-t/tau); zero velocity is not required at t = 0.
struct Settling {
  double amplitude = 0.0;  // m or rad
  double tau_s = 1.0;
};

// A spline of the fifth degree: the sum of its coefficients times the spline about k step_s, which repeats after the last one.
struct NoiseSpline {
  double step_s = 1.0;
  std::vector<double> coefficients;  // rad or m; six and more
};

// Axes: roll, pitch, yaw of the vehicle, yaw adding to the heading (clockwise from north); surge forward and sway
// right along the mean heading, heave up, both level.
struct BaseMotion {
  std::vector<Sine> roll, pitch, yaw;
  std::vector<Sine> surge, heave, sway;
  std::vector<Settling> settling_roll, settling_pitch, settling_surge, settling_heave, settling_sway;
  std::vector<NoiseSpline> noise_roll, noise_pitch, noise_surge, noise_sway;

  bool still() const;
};

// A host lying moored, as in the reference recordings: roll 0.5 deg at 8 s, pitch 0.3 deg at 6 s, yaw 0.2 deg at 11 s
// and 0.05 deg at 130 s; heave 5 cm at 9 s, surge 8 cm at 13 s, sway 6 cm at 10 s.
BaseMotion moored_base_motion();

// The motion at one time. p: displacement from the stated position along n (north, up, east).
struct BaseState {
  Attitude attitude;       // rad
  Attitude attitude_rate;  // rad/s: d/dt of roll, pitch, heading
  Vector3 p_n, v_n, a_n;   // m, m/s, m/s^2
};

BaseState base_state(const BaseMotion& motion, const Attitude& mean, double t);

}  // namespace selfcal::sim
