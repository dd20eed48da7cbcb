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

// Jumps within the years since the calibration, and those of before that what it left unknown may hold.
Jumping jumping(const Watched& one, double last_year, double years) {
  const TypeModel& model = one.filter->model();
  if (!(model.jumps_per_year > 0.0)) {
    return {};
  }
  const double unknown = one.filter->at(last_year).covariance.variance();
  return {model.jumps_per_year, model.jump_sd,
          model.jumps_per_year * years + unknown / (model.jump_sd * model.jump_sd)};
}

double beyond(const Departure& x, double limit) {
  const double scale = std::sqrt(2.0 * x.variance);
  if (!(scale > 0.0)) {
    return std::abs(x.mean) > limit ? 1.0 : 0.0;
  }
  return 0.5 * (std::erfc((limit - x.mean) / scale) + std::erfc((limit + x.mean) / scale));
}

double upper_tail(double h) { return 0.5 * std::erfc(h / std::numbers::sqrt2); }

// Owen's T for h >= 0: an integral without an end in elementary functions, by Gauss & Legendre's five points on each half.
double owen_t(double h, double a) {
  constexpr double at[] = {0.0469100770306680, 0.2307653449471585, 0.5, 0.7692346550528415, 0.9530899229693320};
  constexpr double weight[] = {0.1184634425280945, 0.2393143352496832, 0.2844444444444444, 0.2393143352496832,
                               0.1184634425280945};
  double sum = 0.0;
  for (int half = 0; half < 2; ++half) {
    for (int k = 0; k < 5; ++k) {
      const double x = 0.5 * a * (half + at[k]);
      sum += 0.5 * a * weight[k] * std::exp(-0.5 * h * h * (1.0 + x * x)) / (1.0 + x * x);
    }
  }
  return sum / (2.0 * std::numbers::pi);
}

// Of a jump to take a departure of variance P over the limit.
double crossing(const Departure& x, double jump_sd, double limit) {
  double probability = 0.0;
  for (const double side : {1.0, -1.0}) {
    const double to_limit = limit - side * x.mean;
    const double h = to_limit / std::sqrt(x.variance), after = to_limit / std::hypot(std::sqrt(x.variance), jump_sd);
    if (h > 0.0) {
      probability += 0.5 * (upper_tail(after) - upper_tail(h)) + owen_t(after, jump_sd / std::sqrt(x.variance));
    }
  }
  return probability;
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

double leaving_rate(const Departure& x, const Jumping& jumps, double limit) {
  if (!(jumps.per_year > 0.0)) {
    return leaving_rate(x, limit);
  }
  const double square = jumps.sd * jumps.sd;
  const double without = std::max(1e-3 * x.variance, x.variance - jumps.expected * square);
  double rate = 0.0, of_k = std::exp(-jumps.expected), rest = 1.0;
  for (int k = 0; rest > 1e-4 && k < 60; ++k) {
    Departure given_k = x;
    given_k.variance = without + k * square;
    given_k.approach = x.approach - jumps.per_year * square;
    rate += of_k * (leaving_rate(given_k, limit) + jumps.per_year * crossing(given_k, jumps.sd, limit));
    rest -= of_k;
    of_k *= jumps.expected / (k + 1.0);
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
        const Jumping jumps = jumping(one, last_year, years + 0.5 * step_years);
        probability += step_years * leaving_rate(departure, jumps, one.limit);
      }
    }
    if (probability > risk) {
      return std::max(least, years);
    }
  }
  return most;
}

}  // namespace selfcal::fleet
