// How the dynamic states of a pass go on from one observation to the next: errors of the navigation, motion of the base, biases that
// wander.
#pragma once

#include <cmath>
#include <vector>

#include "estimator/navigation/interval_navigator.hpp"
#include "estimator/passes/motion_model.hpp"

namespace selfcal {

// A bias that changes with time; `parameter` is the bias among the 24. It wanders about its constant value, a Gauss-Markov process of
// first order, stationary, the same when time runs backwards; or, with a rate and no correlation time, it walks away from what it
// is where the pass begins; or it keeps a value from one time to the next, at which it is drawn anew.
struct BiasNoise {
  int parameter = 0;
  double sigma = 0.0;  // of what wanders, SI: m/s^2, rad/s; where the pass begins
  double correlation_s = HUGE_VAL;
  double rate = 0.0;                      // of what walks, per sqrt(s)
  std::vector<double> drawn_anew_s = {};  // rising, recording's time: what wanders is forgotten, and drawn with `sigma`

  bool drawn_in(const Interval& interval) const;
  // Share of its value at one end of an interval that is there at the other.
  double kept(const Interval& interval) const;
  // Of the part that an interval adds.
  double drive_variance(const Interval& interval) const;
};

// Order: navigation errors, motion of the base, biases.
class DynamicTransition {
 public:
  DynamicTransition(const ObservationModel& observation, std::vector<BiasNoise> biases, double interval_s);

  int count() const { return static_cast<int>(Phi_.rows()); }
  int first_bias() const { return count() - static_cast<int>(biases_.size()); }
  // [n x n]; holds until the next call. Motion of the base goes on by whole intervals, biases by the interval's own length: over it
  // acts the mean of what a bias is at both ends.
  const Eigen::MatrixXd& over(const Interval& interval);
  // What a unit of each bias' drive does by the interval's end [n x biases].
  Eigen::MatrixXd drive(const Interval& interval) const;

 private:
  std::vector<BiasNoise> biases_;
  Eigen::MatrixXd Phi_;
};

}  // namespace selfcal
