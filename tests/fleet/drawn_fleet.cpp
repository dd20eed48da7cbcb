#include "tests/fleet/drawn_fleet.hpp"

#include <cmath>

namespace selfcal::fleet {

AgeingValue::AgeingValue(const Nature& nature, std::mt19937_64& random) : nature_(&nature), random_(&random) {
  constant_ = nature.between_units * normal_(random);
  amplitude_ = nature.settling + nature.settling_spread * normal_(random);
  slow_ = nature.slow * normal_(random);
  fast_ = nature.fast * normal_(random);
}

// Exact for any step.
double AgeingValue::wander(double& state, double sd, double years, double dt) {
  const double kept = std::exp(-dt / years);
  state = kept * state + sd * std::sqrt(1.0 - kept * kept) * normal_(*random_);
  return state;
}

double AgeingValue::at(double year) {
  const double dt = year - year_;
  year_ = year;
  return constant_ + amplitude_ * (1.0 - std::exp(-year / nature_->settling_years)) +
         wander(slow_, nature_->slow, nature_->slow_years, dt) + wander(fast_, nature_->fast, nature_->fast_years, dt);
}

}  // namespace selfcal::fleet
