// What turns test results into words and verdicts: shared by the diagnosis of one recording and of two.
#pragma once

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/naming.hpp"

namespace selfcal::diagnosis {

Finding describe(const Chosen& chosen, double rows);
Finding describe(const WalkTest& walk, double rows);

// `alpha`: false-alarm rate of the whole recording; `alpha_elsewhere`: of places that the names have no part in, if less.
// `motion_fitted`: of a moored base.
Adequacy adequacy(double square, double rows, double log_p_white, const Map& map, double alpha, bool motion_fitted,
                  double alpha_elsewhere = 1.0);

}  // namespace selfcal::diagnosis
