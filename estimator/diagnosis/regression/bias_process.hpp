// Noise of a bias, slower than the filter's: it walks, or it wanders and comes back.
#pragma once

#include <vector>

#include "estimator/diagnosis/regression/evidence.hpp"

namespace selfcal::diagnosis {

// How a bias is random. A random walk begins at zero with the recording, and its variance grows with time; an instability is a
// Gauss-Markov process of first order, which forgets within its correlation time (IEEE 952, annex B).
struct BiasKernel {
  enum class Kind { random_walk, instability };
  Kind kind = Kind::random_walk;
  double correlation_s = 0.0;  // of an instability

  // Covariance of the means over [a0, a1] and [b0, b1], seconds since the beginning, of a process of unit size: 1 per sqrt(h) of
  // a walk, 1 sigma of an instability. The intervals are the same, or do not overlap.
  double covariance(double a0, double a1, double b0, double b1) const;
};

// Of one sensor axis, or alike of the three of a triad.
struct BiasProcess {
  struct Other {
    BiasKernel kernel;
    double size = 0.0;
  };
  BiasKernel kernel;
  std::vector<int> axes;             // 0..2 gyro, 3..5 accelerometer
  double delta_chi2 = 0.0;           // twice the log-likelihood gained
  double size = 0.0;                 // map units per sqrt(h); of an instability map units
  double sigma = 0.0;                // of the size
  double correlation_sigma_s = 0.0;  // of the correlation time
  Other other;                       // the other kind in its place
  double probability_of_other_kind = 0.0;

  bool of_gyro() const { return axes.front() < 3; }
  double coefficients() const { return kernel.kind == BiasKernel::Kind::random_walk ? 1.0 : 2.0; }
  double log_p() const;  // not corrected
};

// What the map's columns of dwells and rotations show of it, as far as these are means over whole dwells: the kind, the size and
// the time that a fit begins with.
BiasProcess test_bias_process(const Evidence& evidence, const std::vector<LocatedColumn>& map, int first_map_column,
                              const std::vector<int>& axes, const std::vector<int>& others);

}  // namespace selfcal::diagnosis
