// A fleet drawn at random, whose units age by other laws than the fitted one. One law: they settle exponentially towards a value of
// their own, and wander about it by two Ornstein-Uhlenbeck processes, a fast one and a slow one. Another: they settle as the
// logarithm of time, jump now and then and stay there, and wander fast. No ramp, no random walk.
#pragma once

#include <array>
#include <random>
#include <vector>

#include "estimator/fleet/unit_filter.hpp"

namespace selfcal::fleet {

// All in units of the sigma that a calibration states.
struct Nature {
  double between_units = 20.0;
  double settling = 4.0, settling_spread = 2.0, settling_years = 3.0;
  double slow = 1.5, slow_years = 4.0;
  double fast = 0.5, fast_years = 0.4;
  double creep = 0.0, creep_spread = 0.0;  // by ln(1 + t / 0.3 years)
  double jumps_a_year = 0.0, jump = 0.0;
  double setup = 0.6;
  double sets = 0.2;
};

inline Nature that_jumps() {
  Nature nature;
  nature.settling = nature.settling_spread = nature.slow = 0.0;
  nature.creep = 1.0;
  nature.creep_spread = 0.5;
  nature.jumps_a_year = 0.5;
  nature.jump = 1.2;
  return nature;
}

// The true value of one parameter of one unit, asked for at times that increase.
class AgeingValue {
 public:
  AgeingValue(const Nature& nature, std::mt19937_64& random);
  double at(double year);  // since the unit was new
  // Constant, amplitude of what settles, slow and fast part: as of the last time asked for.
  std::array<double, 4> parts() const { return {constant_, amplitude_, slow_, fast_}; }

 private:
  double wander(double& state, double sd, double years, double dt);
  const Nature* nature_;
  std::mt19937_64* random_;
  std::normal_distribution<double> normal_;
  double constant_, amplitude_, slow_, fast_, creep_, jumped_ = 0.0, year_ = 0.0;
};

}  // namespace selfcal::fleet
