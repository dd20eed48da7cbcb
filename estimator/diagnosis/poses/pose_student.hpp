// What is known of a mean whose noise only few residuals show. Private to this folder.
#pragma once

#include <cmath>

namespace selfcal::diagnosis {

constexpr double least_freedom =
    3.0;  // degrees that residuals must have left, so that they say how far a mean is known

// A value over a sigma by residuals with `freedom` degrees is Student's, of standard deviation sqrt(freedom / (freedom - 2)).
inline double student_widening(double freedom) { return std::sqrt(freedom / (freedom - 2.0)); }

}  // namespace selfcal::diagnosis
