// Process noise of an interval against the integral of what a unit of noise does until its end, done numerically; and the filter with axes that
// are alike against the filter with one density for all.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/navigation/error_dynamics.hpp"

namespace selfcal {
namespace {

constexpr int V = StateLayout::velocity, A = StateLayout::attitude;

Matrix9 covariance_of(const ProcessNoise& noise) { return noise.L * noise.q.asDiagonal() * noise.L.transpose(); }

// Symmetric, with axes that differ by ten, turned away from those of n.
Matrix3 uneven(double density) {
  const Matrix3 C = matrix_from_rotation_vector(Vector3(0.4, -0.7, 1.1));
  return density * density * (C * Vector3(1.0, 9.0, 100.0).asDiagonal() * C.transpose());
}

// Noise enters the attitude (backwards in reverse), the velocity and, of the accelerometers' integral, the position; 400 steps of the middle.
Matrix9 integrated(const SiteModel& site, const WhiteNoise& noise, double T, double sign) {
  constexpr int steps = 400;
  Matrix9 sum = Matrix9::Zero(), N = Matrix9::Zero();
  N.block<3, 3>(0, 0) = noise.velocity;
  N.block<3, 3>(V, V) = noise.force;
  N.block<3, 3>(A, A) = noise.rate;
  for (int k = 0; k < steps; ++k) {
    const Matrix9 Phi = transition(site, -site.gravity_n, T * (k + 0.5) / steps, sign);
    sum += T / steps * Phi * N * Phi.transpose();
  }
  return sum;
}

TEST(ProcessNoise, OfUnevenAxesIsTheIntegral) {
  const SiteModel site({0.7, 2.0, 50.0});
  const WhiteNoise noise{uneven(1e-7), uneven(1e-5), uneven(2e-5)};
  for (const double sign : {1.0, -1.0}) {
    const Matrix9 found = covariance_of(process_noise(site, noise, 1.0, sign));
    const Matrix9 expected = integrated(site, noise, 1.0, sign);
    const Vector9 sigma = expected.diagonal().cwiseSqrt();
    // The Earth turns by 7e-5 in a second, which the factors leave out; the steps are good to 1/400^2.
    EXPECT_LT(((found - expected).array() / (sigma * sigma.transpose()).array()).abs().maxCoeff(), 3e-4) << sign;
  }
}

TEST(ProcessNoise, OfAxesThatAreAlikeIsThatOfOneDensity) {
  const SiteModel site({0.7, 2.0, 50.0});
  const WhiteNoise noise{1e-14 * Matrix3::Identity(), 1e-10 * Matrix3::Identity(), Matrix3::Zero()};
  for (const double sign : {1.0, -1.0}) {
    const Matrix9 one = covariance_of(process_noise(site, 1e-7, 1e-5, 1.0, sign));
    const Matrix9 three = covariance_of(process_noise(site, noise, 1.0, sign));
    EXPECT_LT((one - three).norm(), 1e-12 * one.norm());
  }
}

}  // namespace
}  // namespace selfcal
