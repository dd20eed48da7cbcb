// The 24 and the coefficients as means over every explanation that the recording leaves open (derivation in averaging.cpp).
#pragma once

#include <vector>

#include "estimator/diagnosis/chosen.hpp"
#include "estimator/diagnosis/evidence.hpp"

namespace selfcal::diagnosis {

struct Averages {
  std::vector<Chosen> chosen;  // with size, covariance, sigma of the constant and probabilities
  // What the effects shift the 24 by: mean of all explanations and its covariance.
  ParameterVector shift = ParameterVector::Zero();
  ParameterMatrix shift_covariance = ParameterMatrix::Zero();
};

// `shift` [24 x columns]: of the 24 per unit column. `alternatives`: rivals in a chosen effect's place. A chosen effect whose
// constant is a number has columns for its derivative or for other constants (Chosen).
Averages average_explanations(const Evidence& evidence, const Eigen::MatrixXd& shift, const std::vector<Chosen>& chosen,
                              const std::vector<Candidate>& alternatives);

}  // namespace selfcal::diagnosis
