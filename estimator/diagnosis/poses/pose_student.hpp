// What is known of a mean whose noise only few residuals show. Private to this folder.
#pragma once

#include <cmath>

#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {

constexpr double least_freedom =
    3.0;  // degrees that residuals must have left, so that they say how far a mean is known

// A value over a sigma by residuals with `freedom` degrees is Student's, whose square is F(1, freedom): the factor by which three sigma hold
// what three of a normal number hold, 99.73 %. 3.1 for 3 degrees, 1.5 for 7, 1.2 for 15.
inline double student_widening(double freedom) {
  const double beyond = log_normal_tail(3.0);
  constexpr int halvings = 60;
  double low = 1.0, high = 100.0;
  for (int k = 0; k < halvings; ++k) {
    const double middle = 0.5 * (low + high);
    (log_f_tail(9.0 * middle * middle, 1.0, freedom) > beyond ? low : high) = middle;
  }
  return high;
}

}  // namespace selfcal::diagnosis
