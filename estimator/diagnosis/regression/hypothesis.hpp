// What a recording is explained by, as a value: effects with constants and amplitudes, bias processes, noise.
#pragma once

#include <cmath>
#include <vector>

#include "estimator/diagnosis/regression/bias_process.hpp"

namespace selfcal::diagnosis {

// An effect with one of the constants that are tried for it.
struct Variant {
  const Effect* effect = nullptr;
  double tried =
      NAN;  // of the catalogue's grid, or a line of the spectrum: what tells it from the effect's other variants
  double constant = NAN;  // followed from there to the top of the likelihood; NaN: none
};
// Whatever constants they were followed to.
bool same(const Variant& a, const Variant& b);

struct Term : Variant {
  double constant_sigma = 0.0;  // from the curvature of the likelihood
  Eigen::VectorXd amplitude;    // one a coefficient, in typical sizes
  Eigen::MatrixXd covariance;
};

struct Hypothesis {
  std::vector<Term> terms;
  std::vector<BiasProcess> processes;
  NoiseModel noise;

  bool empty() const { return terms.empty() && processes.empty(); }
  std::size_t size() const { return terms.size() + processes.size(); }
  bool names(const Effect& effect) const;
  // The terms that lie in the increments.
  Correction correction() const;
};

// `h` less its term i.
Hypothesis without_term(Hypothesis h, std::size_t i);

}  // namespace selfcal::diagnosis
