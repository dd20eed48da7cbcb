#include "tests/fleet/drawn_fleet.hpp"

#include <cmath>

namespace selfcal::fleet {

AgeingValue::AgeingValue(const Nature& nature, std::mt19937_64& random) : nature_(&nature), random_(&random) {
  constant_ = nature.between_units * normal_(random);
  amplitude_ = nature.settling + nature.settling_spread * normal_(random);
  slow_ = nature.slow * normal_(random);
  fast_ = nature.fast * normal_(random);
  creep_ = nature.creep > 0.0 ? nature.creep + nature.creep_spread * normal_(random) : 0.0;
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
  if (nature_->jumps_a_year > 0.0 && dt > 0.0) {
    const int jumps = std::poisson_distribution<int>(dt * nature_->jumps_a_year)(*random_);
    jumped_ += nature_->jump * std::sqrt(jumps) * normal_(*random_);
  }
  return constant_ + creep_ * std::log1p(year / 0.3) + jumped_ +
         amplitude_ * (1.0 - std::exp(-year / nature_->settling_years)) +
         wander(slow_, nature_->slow, nature_->slow_years, dt) + wander(fast_, nature_->fast, nature_->fast_years, dt);
}

}  // namespace selfcal::fleet
