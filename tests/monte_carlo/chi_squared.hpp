// Quantiles of the mean of squares of independent standard normals.
#pragma once

namespace selfcal::monte_carlo {

// x with P(chi-squared of `degrees` <= x) = probability. Wilson and Hilferty 1931 (cube root): for 12 degrees and more
// within 1 % down to tails of 1e-5.
double chi_squared_quantile(double probability, double degrees);

}  // namespace selfcal::monte_carlo
