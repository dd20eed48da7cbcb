// What of the 24 is common to several recordings of one unit. The data decide.
//
// Stacked, the 24 of R recordings and the laws' coefficients are one Gaussian vector: theta_r = theta_r0 + S_r c, with c
// common. That two recordings share a parameter is a linear condition on it (joint_gaussian.hpp), imposed where it holds.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/discovery/joint_gaussian.hpp"
#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

// One of the 24 that two recordings do not share.
struct UnsharedParameter {
  int parameter = 0;                     // of sensor_parameters
  std::size_t recording = 0;             // from 1: against the first
  double difference = 0.0, sigma = 0.0;  // SI; that recording less the first
};

struct SharedParameters {
  // What a unit keeps when it is switched off and on, and the six biases, which may be new with each switching on: the
  // logarithm of the p-value of "the same in all recordings"; of the biases, given that the rest is shared if it is.
  double log_p_lasting = 0.0, log_p_biases = 0.0;
  bool lasting_shared = false, biases_shared = false;
  std::vector<UnsharedParameter> differing;  // of what is not shared, those of 4 sigma and more, largest first
  std::vector<ParameterVector> parameters;   // [recordings] SI, with what is shared imposed
  std::vector<ParameterMatrix> covariance;   // [recordings]
  Eigen::VectorXd coefficient;               // of the laws, likewise
  Eigen::MatrixXd coefficient_covariance;    // [terms + constants]
};

// `rate`: at which one of the two conditions is refused although it holds.
SharedParameters share_parameters(const LawFit& fit, double rate = 0.01);

// The same in two steps, for a vector of the 24 of `recordings` and what else stands behind them. Decides, and imposes on `all`
// what holds: the decisions.
SharedParameters share(JointGaussian& all, std::size_t recordings, double rate = 0.01);
// The 24 as `all` has them.
void read_parameters(const JointGaussian& all, std::size_t recordings, SharedParameters& result);

}  // namespace selfcal::discovery
