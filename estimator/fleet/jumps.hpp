// Whether w of (F1) walks in many small steps or in few large ones.
//
// Over a time Dt a walk by jumps (a compound Poisson process: rate lambda, normal jumps of sd s) has the variance of a normal one,
// q Dt with q = lambda s^2, and the fourth cumulant 3 lambda s^4 Dt, where a normal one has none. It shows in what a filter learns
// of a unit meanwhile,
//
//   d = x(t1|t1) - x(t1|t0),   var d = P(t1|t0) - P(t1|t1),   kappa4(d) = 3 lambda s^4 integral of w^4      (F4)
//
// w(tau): what of a jump at tau the filter has seen by t1. From kappa4, and q as fitted, follow s and lambda.
#pragma once

#include <span>

#include "estimator/fleet/unit_filter.hpp"

namespace selfcal::fleet {

struct Jumps {
  double per_year = 0.0, sd = 0.0;
};

// None where the fourth cumulant is not beyond what normal walks show by chance (four sigma: of 24 parameters one in a thousand).
Jumps jumps_of(std::span<const UnitHistory> units, const TypeModel& model);

}  // namespace selfcal::fleet
