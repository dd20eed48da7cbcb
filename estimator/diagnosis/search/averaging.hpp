// The 24 and the coefficients as means over every explanation that the recording leaves open (derivation in averaging.cpp).
#pragma once

#include <map>
#include <vector>

#include "estimator/diagnosis/regression/evidence.hpp"

namespace selfcal::diagnosis {

// A term and the columns that stand for it.
struct PlacedTerm {
  Candidate candidate;
  Eigen::VectorXd amplitude;    // fitted, in typical sizes
  double constant_sigma = 0.0;  // from the curvature of the likelihood
  int derivative = -1;          // first column of its derivative by the constant's logarithm; -1: it has no constant
  std::vector<Candidate> constants = {};  // the same effect with constants about its own, in order
};

// The mean over the explanations in a term's place.
struct AveragedTerm {
  Eigen::VectorXd amplitude;  // with all coefficients unknown
  Eigen::MatrixXd covariance;
  double constant_sigma = 0.0;
  std::map<const Effect*, double> probability = {};  // of every effect in this one's place, all equally likely before
};

struct Averages {
  std::vector<AveragedTerm> terms;
  // What the terms shift the 24 by: mean of all explanations and its covariance.
  ParameterVector shift = ParameterVector::Zero();
  ParameterMatrix shift_covariance = ParameterMatrix::Zero();
};

// `shift` [24 x columns]: of the 24 per unit column. `alternatives`: rivals in a term's place.
Averages average_explanations(const Evidence& evidence, const Eigen::MatrixXd& shift,
                              const std::vector<PlacedTerm>& terms, const std::vector<Candidate>& alternatives);

}  // namespace selfcal::diagnosis
