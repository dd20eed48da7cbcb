// Bands of estimates that scatter. Private to this folder.
#pragma once

#include <vector>

#include "tools/report/overlay.hpp"

namespace selfcal::report {

// Variances (or densities) of `freedom` degrees each: the logarithm of their ratio has mean psi(a/2) - ln(a/2) - psi(b/2) + ln(b/2)
// and variance psi'(a/2) + psi'(b/2), and is near normal from ten degrees on. `least_variance`: of that logarithm, where more is known
// of it than the degrees of freedom say.
OverlayPoint ratio_point(double x, double recording, double simulation, double freedom_recording,
                         double freedom_simulation, double least_variance = 0.0);

// Sums and counts of one quantity dwell by dwell, in time's order.
struct Part {
  double sum = 0.0, count = 0.0;
};
double mean_of(const std::vector<Part>& parts);
// Variance of the logarithm of the ratio of both means, from how the difference scatters from dwell to dwell: a quantum makes lines that
// depend on the attitude, which no chi-squared knows. 0 where the parts are not pairs or fewer than eight.
double scatter_of(const std::vector<Part>& recording, const std::vector<Part>& simulation);
// Variance of sum over count of these parts, from how each part differs from the whole: noise that is loud at times, or that remembers for
// less than a part lasts, scatters by more than noise of one variance would. 0 where there are fewer than eight parts.
double variance_of_mean(const std::vector<Part>& parts);
// Estimates with these variances.
OverlayPoint difference_point(double x, double recording, double simulation, double variance);

}  // namespace selfcal::report
