// The U-D filter against a plain dense Kalman filter in long double.
#include <gtest/gtest.h>

#include <random>

#include "estimator/filter/ud_filter.hpp"

namespace selfcal {
namespace {

using MatrixL = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using VectorL = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

TEST(UdFilter, AgreesWithADenseFilter) {
  constexpr int d = 5, c = 4, n = d + c;
  std::mt19937_64 engine(3);  // seed 3
  std::normal_distribution<double> normal;
  const auto random = [&](int rows, int cols) {
    return MatrixX::NullaryExpr(rows, cols, [&] { return normal(engine); }).eval();
  };
  const VectorX mean = random(n, 1), sigma = random(n, 1).cwiseAbs().array() + 0.5;
  UdFilter filter(mean, sigma, c);
  VectorL x = mean.cast<long double>();
  MatrixL P = sigma.cwiseAbs2().asDiagonal().toDenseMatrix().cast<long double>();
  for (int step = 0; step < 50; ++step) {
    const MatrixX Phi = MatrixX::Identity(d, d) + 0.1 * random(d, d), Gamma = random(d, c), L = random(d, 3);
    const VectorX drive = random(d, 1), q = random(3, 1).cwiseAbs(), h = random(d, 1);
    const double value = normal(engine);
    filter.propagate(Phi, Gamma, drive, L, q);
    const ScalarInnovation innovation = filter.update(h, value, 0.3);

    MatrixL F = MatrixL::Identity(n, n);
    F.topLeftCorner(d, d) = Phi.cast<long double>();
    F.topRightCorner(d, c) = Gamma.cast<long double>();
    x = (F * x).eval();
    x.head(d) += drive.cast<long double>();
    P = (F * P * F.transpose()).eval();
    P.topLeftCorner(d, d) += (L * q.asDiagonal() * L.transpose()).cast<long double>();
    VectorL H = VectorL::Zero(n);
    H.head(d) = h.cast<long double>();
    const long double S = H.dot(P * H) + 0.3L, r = value - H.dot(x);
    const VectorL K = P * H / S;
    x += K * r;
    P -= (K * K.transpose() * S).eval();

    // Some 50 steps of ten operations round by 1e-13 of the largest element; 1e-10 leaves room for cancellation.
    const double scale = P.cast<double>().norm();
    EXPECT_LT((filter.covariance() - P.cast<double>()).norm(), 1e-10 * scale) << "step " << step;
    EXPECT_LT((filter.mean() - x.cast<double>()).norm(), 1e-10 * (1.0 + x.cast<double>().norm() + scale));
    EXPECT_NEAR(innovation.variance, static_cast<double>(S), 1e-10 * static_cast<double>(S));
    EXPECT_GT(filter.variances().minCoeff(), 0.0);
  }
}

}  // namespace
}  // namespace selfcal
