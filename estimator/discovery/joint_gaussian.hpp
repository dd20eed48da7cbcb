// Unknowns of several recordings as one Gaussian vector, and linear conditions on it: that two of them are equal is tested by
// the square of D x in units of its covariance, and imposed by conditioning, x - C D' (D C D')^-1 D x.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

struct JointGaussian {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;

  // The 24 of each recording in turn, and behind them `value` with its covariance. The 24 follow `value` by each recording's
  // shift [24 x values]; the recordings' parameters are those at `value`.
  static JointGaussian of(std::span<const FittedRecording> recordings, const Eigen::VectorXd& value,
                          const Eigen::MatrixXd& value_covariance);

  // Logarithm of the p-value of D x = 0.
  double log_p_of_zero(const Eigen::MatrixXd& D) const;
  void impose(const Eigen::MatrixXd& D);
};

// Rows of "the k-th of `places` less the first", elements [from, to) of each; `places`: where each begins in x. [rows x size]
Eigen::MatrixXd differences(const std::vector<Eigen::Index>& places, Eigen::Index from, Eigen::Index to,
                            Eigen::Index size);

}  // namespace selfcal::discovery
