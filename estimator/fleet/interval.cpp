#include "estimator/fleet/interval.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal::fleet {
namespace {

constexpr double step_years = 7.0 / 365.2425;

Departure departure_of(const Watched& one, double year) {
  const UnitState state = one.filter->at(year);
  return {state.value() - one.measured, state.slope(), state.covariance.variance(), state.covariance.approach()};
}

double beyond(const Departure& x, double limit) {
  const double scale = std::sqrt(2.0 * x.variance);
  if (!(scale > 0.0)) {
    return std::abs(x.mean) > limit ? 1.0 : 0.0;
  }
  return 0.5 * (std::erfc((limit - x.mean) / scale) + std::erfc((limit + x.mean) / scale));
}

}  // namespace

double leaving_rate(const Departure& x, double limit) {
  if (!(x.variance > 0.0)) {
    return 0.0;
  }
  double rate = 0.0;
  for (const double side : {1.0, -1.0}) {
    const double to_limit = limit - side * x.mean;
    const double density =
        std::exp(-0.5 * to_limit * to_limit / x.variance) / std::sqrt(2.0 * std::numbers::pi * x.variance);
    rate += density * std::max(0.0, to_limit * x.approach / x.variance + side * x.slope);
  }
  return rate;
}

double interval_years(std::span<const Watched> parameters, double last_year, double risk, double least, double most) {
  double probability = 0.0;
  for (const Watched& one : parameters) {
    if (one.limit > 0.0) {
      probability += beyond(departure_of(one, last_year), one.limit);
    }
  }
  for (double years = 0.0; years + step_years < most; years += step_years) {
    for (const Watched& one : parameters) {
      if (one.limit > 0.0) {
        const Departure departure = departure_of(one, last_year + years + 0.5 * step_years);
        probability += step_years * leaving_rate(departure, one.limit);
      }
    }
    if (probability > risk) {
      return std::max(least, years);
    }
  }
  return most;
}

}  // namespace selfcal::fleet
