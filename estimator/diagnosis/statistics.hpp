// Tails of distributions, in logarithms: strong effects have p-values that no double can hold.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace selfcal::diagnosis {

// Natural logarithm of P(chi-squared with `degrees` > value). Series and continued fraction of the incomplete gamma
// function (Abramowitz and Stegun 6.5.29, 6.5.31); relative error below 1e-10.
double log_chi_squared_tail(double value, double degrees);
// log of min(1, count * p), given log p.
double log_corrected(double log_p, double count);
// The |z| whose two-sided normal tail has this log p; for words.
double sigma_from_log_p(double log_p);

// One of the normal distributions that make up a mixture; sigma 0: a point.
struct Share {
  double weight = 0.0, mean = 0.0, sigma = 0.0;
};
// Sigma with which `centre` +- 1.96 sigma holds 95 % of the mixture, at least the rms about `centre`: a mixture of a narrow
// and a wide one has tails that its rms does not show, and a rare far one a rms that its 95 % do not.
double sigma_about(double centre, const std::vector<Share>& shares);

// Regression of unit-noise residuals on columns, from its normal equations. Directions in which even `most` typical
// sizes would not be seen count as invisible: they take no degree of freedom.
struct Fit {
  Eigen::VectorXd value;       // in the columns' units
  Eigen::MatrixXd covariance;  // with a prior of `most` on every coefficient
  double gain = 0.0;           // fall of the residual's square
  int rank = 0;
};
Fit fit_columns(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, double most = 300.0);
// Rows r_k of the visible directions with gain = sum (r_k score)^2, as fit_columns takes them.
Eigen::MatrixXd visible_root(const Eigen::MatrixXd& information, double most = 300.0);

}  // namespace selfcal::diagnosis
