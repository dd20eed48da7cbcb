// Tails of distributions, in natural logarithms: strong effects have p-values that no double can hold.
#pragma once

namespace selfcal {

// log P(chi-squared with `degrees` > value). Series and continued fraction of the incomplete gamma function (Abramowitz and
// Stegun 6.5.29, 6.5.31); relative error below 1e-10.
double log_chi_squared_tail(double value, double degrees);
// log P(|x| > z) of a standard normal.
double log_normal_tail(double z);
// log P(F with these degrees of freedom > f), by the continued fraction of the incomplete beta function (26.5.8).
double log_f_tail(double f, double numerator, double denominator);

// log of min(1, count * p), given log p.
double log_corrected(double log_p, double count);
// The |z| whose two-sided normal tail has this log p; for words.
double sigma_from_log_p(double log_p);

}  // namespace selfcal
