// Kalman filter in U-D form, for a state of which the last part is constant.
//
// P = U diag(D) U^T with U unit upper triangular: P cannot lose symmetry or sign, whatever the rounding. With the
// constants last, a time step touches only the rows of the dynamic states: [eq. (F1)-(F3) of estimator/README.md].
// Source: Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. V (measurement) and VI (time).
#pragma once

#include <Eigen/Core>

namespace selfcal {

using VectorX = Eigen::VectorXd;
using MatrixX = Eigen::MatrixXd;

struct ScalarInnovation {
  double value = 0.0;     // observed minus predicted
  double variance = 0.0;  // predicted
};

class UdFilter {
 public:
  // x ~ (mean, diag(sigma^2)); the last `constants` states are constant.
  UdFilter(const VectorX& mean, const VectorX& sigma, int constants);

  // Replaces the covariance of the last rows of the constants, uncorrelated with the rest. `covariance` [m x m]
  // positive definite covers the first m constants.
  void set_constant_covariance(const MatrixX& covariance);

  // x_d' = Phi x_d + Gamma x_c + drive + L w, w ~ (0, diag(q)). Phi [d x d], Gamma [d x c], drive [d], L [d x k],
  // q [k].
  void propagate(const MatrixX& Phi, const MatrixX& Gamma, const VectorX& drive, const MatrixX& L, const VectorX& q);

  // Observation of value = h^T x + noise; h has `rows` in the dynamic part alone.
  // Returns the innovation and its variance before the update.
  ScalarInnovation update(const VectorX& h_dynamic, double value, double noise_variance);

  const VectorX& mean() const { return x_; }
  MatrixX covariance() const;
  VectorX variances() const;
  // The gain of the last update, [n]: for signatures that are carried alongside.
  const VectorX& gain() const { return gain_; }
  int size() const { return static_cast<int>(x_.size()); }
  int dynamic_size() const { return dynamic_; }

 private:
  int dynamic_;
  VectorX x_;
  MatrixX U_;
  VectorX D_;
  using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  MatrixX product_;             // [d x the greater of c and d] what Phi makes of U
  RowMajorMatrix work_;         // [d x (d+k)] rows of the weighted Gram-Schmidt
  VectorX weights_, weighted_;  // [d+k]
  VectorX f_, v_, gain_;
};

}  // namespace selfcal
