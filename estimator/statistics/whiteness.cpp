#include "estimator/statistics/whiteness.hpp"

#include <algorithm>

#include "estimator/statistics/distributions.hpp"

namespace selfcal {

Whiteness test_whiteness(const Eigen::Ref<const Eigen::VectorXd>& innovations) {
  constexpr int axes = 3;
  const Eigen::Index epochs = innovations.size() / axes;
  const Eigen::Index lags = std::min<Eigen::Index>(20, epochs - 1);
  const auto n = static_cast<double>(epochs);
  Whiteness result;
  double statistic = 0.0;
  for (int axis = 0; axis < axes; ++axis) {
    const auto at = [&](Eigen::Index epoch) { return innovations(axes * epoch + axis); };
    double square = 0.0;
    for (Eigen::Index k = 0; k < epochs; ++k) {
      square += at(k) * at(k);
    }
    for (Eigen::Index lag = 1; lag <= lags; ++lag) {
      double product = 0.0;
      for (Eigen::Index k = lag; k < epochs; ++k) {
        product += at(k) * at(k - lag);
      }
      const double r = product / square;
      statistic += n * (n + 2.0) * r * r / (n - static_cast<double>(lag));
      result.autocorrelation += lag == 1 ? r / axes : 0.0;
    }
  }
  result.log_p = log_chi_squared_tail(statistic, static_cast<double>(axes * lags));
  return result;
}

}  // namespace selfcal
