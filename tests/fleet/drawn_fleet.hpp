// A fleet drawn at random, whose units age by another law than the fitted one: they settle exponentially towards a value of
// their own, and wander about it by two Ornstein-Uhlenbeck processes, a fast one and a slow one. No ramp, no random walk.
#pragma once

#include <random>
#include <vector>

#include "estimator/fleet/fleet_model.hpp"

namespace selfcal::fleet {

// All in units of the sigma that a calibration states.
struct Nature {
  double between_units = 20.0;
  double settling = 4.0, settling_spread = 2.0, settling_years = 3.0;
  double slow = 1.5, slow_years = 4.0;
  double fast = 0.5, fast_years = 0.4;
  double setup = 0.6;
  double sets = 0.2;
};

// The true value of one parameter of one unit, asked for at times that increase.
class AgeingValue {
 public:
  AgeingValue(const Nature& nature, std::mt19937_64& random);
  double at(double year);  // since the unit was new

 private:
  double wander(double& state, double sd, double years, double dt);
  const Nature* nature_;
  std::mt19937_64* random_;
  std::normal_distribution<double> normal_;
  double constant_, amplitude_, slow_, fast_, year_ = 0.0;
};

}  // namespace selfcal::fleet
