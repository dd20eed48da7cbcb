// Regression on columns from its normal equations, and sigmas of mixtures.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace selfcal::diagnosis {

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
  double delta_chi2 = 0.0;     // fall of the residual's square
  int rank = 0;
};
// Solves the normal equations of columns that are fitted beside those in question, with a prior of 1000 typical sizes (no sensor
// is that bad), so that a direction that nothing shows is left alone instead of divided by zero.
Eigen::LDLT<Eigen::MatrixXd> solver_beside(Eigen::MatrixXd information);
Fit fit_columns(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, double most = 300.0);
// Rows r_k of the visible directions with delta_chi2 = sum (r_k score)^2, as fit_columns takes them.
Eigen::MatrixXd visible_root(const Eigen::MatrixXd& information, double most = 300.0);

}  // namespace selfcal::diagnosis
