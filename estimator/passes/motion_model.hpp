// Motion of a moored base as damped oscillations, seen once per update interval.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace selfcal {

// (c, s) turns by omega T and shrinks by exp(-T/decay) per interval, driven so that both keep the variance sigma^2;
// c is the displacement. A stationary Gaussian process, the same when time runs backwards. decay to infinity: a pure
// line of random amplitude and phase.
struct Oscillation {
  double omega = 0.0;    // rad/s
  double decay_s = 0.0;  // of the correlation
  double sigma = 0.0;    // m
};

// Along one axis of n: the sum of its oscillations.
struct MotionModel {
  std::vector<Oscillation> oscillations;

  int state_count() const { return 2 * static_cast<int>(oscillations.size()); }
  // What one interval adds that could not be foreseen, 1 sigma, m.
  double unforeseen(double interval_s) const;
};

// A random walk of `density` (m/sqrt(s)): an oscillation that never turns and whose correlation, 1e5 s, lies far beyond
// any recording. White noise of the accelerometers' integral (a coarse quantum, dither that leaks through) walks so.
MotionModel position_walk(double density);
// The density of such a walk; 0 for any other motion.
double walk_density(const MotionModel& motion);

// One interval of an oscillation: c' = cosine c - sine s, s' = sine c + cosine s, each plus noise.
struct OscillationStep {
  double cosine = 0.0, sine = 0.0;  // damping included
  double drive_variance = 0.0;      // m^2, of either
  OscillationStep(const Oscillation& oscillation, double interval_s);
};

// The position of the site is observed at every update epoch as 0 = position error + motion + white noise.
struct ObservationModel {
  double sigma = 1e-5;                // white, m, for a 1 s interval
  std::array<MotionModel, 3> motion;  // north, up, east
  int state_count() const;
  // Of all motion states, axis by axis, [n x n].
  Eigen::MatrixXd transition(double interval_s) const;
};

}  // namespace selfcal
