// Until when a unit may go without a calibration.
#pragma once

#include <span>

#include "estimator/fleet/unit_filter.hpp"

namespace selfcal::fleet {

// One filter, measured value and limit for each parameter; a limit of 0 is none.
struct Watched {
  const UnitFilter* filter = nullptr;
  double measured = 0.0;  // by the last calibration, compensated since
  double limit = 0.0;     // of the true value's departure from it
};

// A departure from what was measured, normal; in a year hence and so on it is another one.
struct Departure {
  double mean = 0.0, slope = 0.0;  // and its change a year
  double variance = 0.0;
  double approach = 0.0;  // c of (F3)
};

// The rate, in a year, at which a departure x(t) of mean mu and variance P leaves a limit a on either side:
//
//   p(t) = ((a - mu) c / P + dmu/dt) N(a; mu, P),   c = d/ds cov(x(s), x(t)), s -> t from below     (F3)
//
// Durbin, J. Appl. Prob. 22, 1985, first approximation: exact for a random walk, and for a ramp, from a known start; the rate of
// rare departures of what comes back.
double leaving_rate(const Departure& departure, double limit);

// The same where the walk goes by jumps: lambda a year, and `expected` of them in what is not known of the departure, since the last
// calibration or left unknown by it. A Poisson mixture over their number k, with the variance P_k = P - expected s^2 + k s^2 and what of
// c is no walk's; and the jumps' own crossings,
//
//   lambda P(|x| < a, |x + J| > a) = lambda sum over both sides (Q(h') - Q(h)) / 2 + T(h', s / sqrt(P_k))   (F5)
//
// h = (a - mu) / sqrt(P_k), h' = (a - mu) / sqrt(P_k + s^2), T: Owen's (Ann. Math. Statist. 27, 1956).
struct Jumping {
  double per_year = 0.0, sd = 0.0, expected = 0.0;
};
double leaving_rate(const Departure& departure, const Jumping& jumps, double limit);

// Years from the last calibration until the probability that the true value has left its limits since then in any of the parameters
// reaches `risk`; between `least` and `most`.
double interval_years(std::span<const Watched> parameters, double last_year, double risk, double least, double most);

}  // namespace selfcal::fleet
