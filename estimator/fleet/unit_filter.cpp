#include "estimator/fleet/unit_filter.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::fleet {
namespace {

double square(double x) { return x * x; }

}  // namespace

UnitCovariance::UnitCovariance(const Ageing& ageing)
    : ageing_(ageing), p_{square(ageing.unit_sd), 0.0, 0.0, square(ageing.ramp_sd), 0.0, square(ageing.settling_sd)} {}

double UnitCovariance::advance(double years) {
  auto& [level, level_ramp, level_v, ramp, ramp_v, v] = p_;
  const double kept = std::exp(-years * return_rate());
  level += years * (2.0 * level_ramp + years * ramp) + square(ageing_.walk_sd) * years;
  level_ramp += years * ramp;
  level_v = kept * (level_v + years * ramp_v);
  ramp_v *= kept;
  v = square(kept) * v + square(ageing_.wander_sd) * (1.0 - square(kept));
  return kept;
}

double UnitCovariance::slope_variance() const {
  const double rate = return_rate();
  return p_[3] - 2.0 * rate * p_[4] + square(rate) * p_[5];
}

// The value's covariance with ramp and with v, through the value's expected slope, and what comes in anew.
double UnitCovariance::approach() const {
  const double rate = return_rate();
  return (p_[1] + p_[4]) - rate * (p_[2] + p_[5]) + square(ageing_.walk_sd) + 2.0 * rate * square(ageing_.wander_sd);
}

std::array<double, 3> UnitCovariance::take(double noise_variance) {
  auto& [level, level_ramp, level_v, ramp, ramp_v, v] = p_;
  const std::array<double, 3> with_value{level + level_v, level_ramp + ramp_v, level_v + v};
  const double variance = with_value[0] + with_value[2] + noise_variance;
  const std::array<double, 3> gain{with_value[0] / variance, with_value[1] / variance, with_value[2] / variance};
  level -= gain[0] * with_value[0];
  level_ramp -= gain[0] * with_value[1];
  level_v -= gain[0] * with_value[2];
  ramp -= gain[1] * with_value[1];
  ramp_v -= gain[1] * with_value[2];
  v -= gain[2] * with_value[2];
  return gain;
}

double UnitState::sigma() const { return std::sqrt(std::max(0.0, covariance.variance())); }
double UnitState::slope_sigma() const { return std::sqrt(std::max(0.0, covariance.slope_variance())); }

UnitFilter::UnitFilter(const TypeModel& model, double first_year)
    : model_(&model),
      state_{first_year,
             model.mean,
             model.ramp_per_year,
             model.settling,
             model.return_years > 0.0 ? 1.0 / model.return_years : 0.0,
             UnitCovariance(model)} {}

UnitState UnitFilter::at(double year) const {
  UnitState later = state_;
  const double years = std::max(0.0, year - state_.year);
  later.year = year;
  later.level += years * later.ramp;
  later.returning *= later.covariance.advance(years);
  return later;
}

Innovation UnitFilter::add(const Measurement& measurement) {
  state_ = at(measurement.year);
  const SetOffset& set = model_->sets.at(static_cast<std::size_t>(measurement.set));
  const double noise = square(model_->setup_sd) + square(measurement.sigma) + square(set.sigma);
  const Innovation innovation{measurement.value - set.value - state_.value(), state_.covariance.variance() + noise};
  const auto gain = state_.covariance.take(noise);
  state_.level += gain[0] * innovation.value;
  state_.ramp += gain[1] * innovation.value;
  state_.returning += gain[2] * innovation.value;
  return innovation;
}

double UnitFilter::variance_of_measurement(double year, double sigma) const {
  return at(year).covariance.variance() + square(model_->setup_sd) + square(model_->set_sd) + square(sigma);
}

}  // namespace selfcal::fleet
