#include "estimator/filter/ud_filter.hpp"

#include <algorithm>
#include <cassert>

namespace selfcal {
namespace {

// The first columns of `out` = A B, of some ten rows: column by column of A, so that sums run beside each other. Of column j of B the first
// `rows(j)` count, the others are zero.
template <typename Right, typename Rows>
void multiply(const MatrixX& A, const Right& B, MatrixX& out, Rows rows) {
  for (Eigen::Index j = 0; j < B.cols(); ++j) {
    auto column = out.col(j);
    column.setZero();
    for (Eigen::Index k = 0; k < rows(j); ++k) {
      column += B(k, j) * A.col(k);
    }
  }
}

}  // namespace

UdFilter::UdFilter(const VectorX& mean, const VectorX& sigma, int constants)
    : dynamic_(static_cast<int>(mean.size()) - constants),
      x_(mean),
      U_(MatrixX::Identity(mean.size(), mean.size())),
      D_(sigma.cwiseAbs2()),
      product_(dynamic_, std::max(dynamic_, constants)),
      f_(mean.size()),
      v_(mean.size()),
      gain_(VectorX::Zero(mean.size())) {
  assert(mean.size() == sigma.size() && dynamic_ > 0);
}

void UdFilter::set_constant_covariance(const MatrixX& covariance) {
  MatrixX P = covariance;
  for (Eigen::Index j = P.cols() - 1; j >= 0; --j) {  // P = U D U^T, from the last column
    const Eigen::Index at = dynamic_ + j;
    assert(P(j, j) > 0.0);
    D_(at) = P(j, j);
    U_.col(at).segment(dynamic_, j) = P.col(j).head(j) / P(j, j);
    P.topLeftCorner(j, j).noalias() -= P.col(j).head(j) * P.col(j).head(j).transpose() / P(j, j);
  }
}

void UdFilter::propagate(const MatrixX& Phi, const MatrixX& Gamma, const VectorX& drive, const MatrixX& L,
                         const VectorX& q) {
  const int d = dynamic_;
  const int c = size() - d;
  x_.head(d) = (Phi * x_.head(d)).eval() + Gamma * x_.tail(c) + drive;

  // (F2): U_xp' = Phi U_xp + Gamma U_pp, before U_xx changes.
  multiply(Phi, U_.topRightCorner(d, c), product_, [&](Eigen::Index) { return d; });
  U_.topRightCorner(d, c) = product_.leftCols(c);
  U_.topRightCorner(d, c).noalias() += Gamma * U_.bottomRightCorner(c, c).triangularView<Eigen::UnitUpper>();

  // (F1): U_xx' D_x' U_xx'^T = Phi U_xx D_x U_xx^T Phi^T + L q L^T by modified weighted Gram-Schmidt.
  work_.resize(d, d + q.size());
  multiply(Phi, U_.topLeftCorner(d, d), product_, [](Eigen::Index j) { return j + 1; });
  work_.leftCols(d) = product_.leftCols(d);
  work_.rightCols(q.size()) = L;
  weights_.resize(d + q.size());
  weights_ << D_.head(d), q;
  for (int i = d - 1; i >= 0; --i) {
    weighted_ = work_.row(i).transpose().cwiseProduct(weights_);
    const double norm = work_.row(i).dot(weighted_);
    D_(i) = norm;
    for (int j = 0; j < i; ++j) {
      const double u = norm > 0.0 ? work_.row(j).dot(weighted_) / norm : 0.0;
      U_(j, i) = u;
      work_.row(j) -= u * work_.row(i);
    }
  }
}

ScalarInnovation UdFilter::update(const VectorX& h_dynamic, double value, double noise_variance) {
  const int n = size();
  const int d = dynamic_;
  f_.noalias() = U_.topRows(d).transpose() * h_dynamic;
  v_ = D_.cwiseProduct(f_);
  const double innovation = value - h_dynamic.dot(x_.head(d));
  double alpha = noise_variance;
  gain_.setZero();
  for (int j = 0; j < n; ++j) {
    const double previous = alpha;
    alpha += f_(j) * v_(j);
    if (previous > 0.0) {
      D_(j) *= previous / alpha;
      const double lambda = -f_(j) / previous;
      double* u = U_.col(j).data();
      double* k = gain_.data();
      const double v = v_(j);
      for (int i = 0; i < j; ++i) {
        const double old = u[i];
        u[i] = old + lambda * k[i];
        k[i] += v * old;
      }
    } else {  // no noise yet: this column takes all of it
      D_(j) = alpha > 0.0 ? 0.0 : D_(j);
      gain_.head(j) += v_(j) * U_.col(j).head(j);
    }
    gain_(j) = v_(j);
  }
  gain_ /= alpha;
  x_ += innovation * gain_;
  return {innovation, alpha};
}

MatrixX UdFilter::covariance() const {
  const MatrixX U = U_.triangularView<Eigen::UnitUpper>();
  return U * D_.asDiagonal() * U.transpose();
}

VectorX UdFilter::variances() const {
  VectorX variance(size());
  for (int i = 0; i < size(); ++i) {
    variance(i) = D_(i) + (U_.row(i).tail(size() - i - 1).cwiseAbs2() * D_.tail(size() - i - 1)).value();
  }
  return variance;
}

}  // namespace selfcal
