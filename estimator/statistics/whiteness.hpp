// Are the innovations of a filter white?
#pragma once

#include <Eigen/Core>

namespace selfcal {

struct Whiteness {
  double log_p = 0.0;            // natural logarithm of the portmanteau test's p
  double autocorrelation = 0.0;  // from one epoch to the next, mean of the axes
};

// Portmanteau test of Ljung and Box (Biometrika 65, 1978) on normalised innovations of three axes, [3 x epochs] column by
// column: lags 1 to 20 of the three axes together. Fewer epochs than that: the lags that there are.
Whiteness test_whiteness(const Eigen::Ref<const Eigen::VectorXd>& innovations);

}  // namespace selfcal
