// What a search has chosen, and what it suspects.
#pragma once

#include <map>
#include <vector>

#include "estimator/diagnosis/signature_pass.hpp"

namespace selfcal::diagnosis {

struct Chosen {
  Candidate candidate;          // columns as in the naming's candidates
  double constant_sigma = 0.0;  // of the candidate's constant, from the curvature of the likelihood
  int derivative = -1;          // first column of its derivative by the constant's logarithm, once averaged
  std::vector<Candidate>
      constants;         // the same effect with constants about its own, columns of their own, once averaged
  Eigen::VectorXd size;  // fitted, in typical sizes
  Eigen::MatrixXd covariance;
  double log_p = 0.0;  // given the others, corrected for variants and effects
  double gain = 0.0;
  int rank = 0;
  double held_out = 0.0;
  std::vector<const Effect*> equivalent;
  std::map<const Effect*, double> probability;  // of every effect in this one's place, all equally likely before
};

struct Suspect {
  const Effect* effect = nullptr;
  double log_p = 0.0;
  double expected_z = 0.0;
};

}  // namespace selfcal::diagnosis
