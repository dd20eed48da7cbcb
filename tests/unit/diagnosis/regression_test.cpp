#include "estimator/diagnosis/regression/regression.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/regression/evidence.hpp"

namespace selfcal::diagnosis {
namespace {

// A direction that even 300 typical sizes would not show (information below 1/300^2) takes no degree of freedom.
TEST(FitColumns, LeavesOutWhatCannotBeSeen) {
  Eigen::Matrix2d information;
  information << 25.0, 0.0, 0.0, 1e-6;
  const Fit fit = fit_columns(information, Eigen::Vector2d(50.0, 1.0));
  EXPECT_EQ(fit.rank, 1);
  EXPECT_NEAR(fit.value(0), 2.0, 1e-12);
  EXPECT_NEAR(fit.delta_chi2, 100.0, 1e-9);
  const Fit seen = fit_columns(Eigen::Matrix2d::Identity(), Eigen::Vector2d(50.0, 1.0));
  EXPECT_EQ(seen.rank, 2);  // the negative control
}

// Where nothing is named and every axis has its noise there is no column. BLAS would say on standard output, where an answer is read from, that
// a matrix without elements is an error.
TEST(EvidenceOfRows, WithoutColumnsSaysNothing) {
  SignatureRows rows;
  rows.columns.resize(3, 0);
  rows.residual = Eigen::Vector3d(1.0, 2.0, 2.0);
  testing::internal::CaptureStdout();
  const Evidence evidence(rows);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(evidence.information.size(), 0);
  EXPECT_EQ(evidence.square, 9.0);
}

TEST(SigmaAbout, IsThatOfASingleNormal) {
  EXPECT_NEAR(sigma_about(3.0, {{0.2, 3.0, 0.7}}), 0.7, 1e-12);
  EXPECT_EQ(sigma_about(3.0, {{1.0, 3.0, 0.0}}), 0.0);
  // Told one sigma off: the rms is sqrt(2), and 1 +- 2.77 holds 96 %.
  EXPECT_NEAR(sigma_about(1.0, {{1.0, 0.0, 1.0}}), std::sqrt(2.0), 1e-12);
}

// Nine tenths at 0 and one tenth N(0, 10^2): 95 % leave half of the wide one outside, beyond its 0.67449 sigma. Its rms,
// sqrt(10), would hold 94.6 %.
TEST(SigmaAbout, HoldsTheTailOfTheWiderOne) {
  EXPECT_NEAR(sigma_about(0.0, {{0.9, 0.0, 0.0}, {0.1, 0.0, 10.0}}), 6.7449 / 1.95996, 1e-4);
}

// 4 % far off are beyond every interval of 95 %; the rms remembers them.
TEST(SigmaAbout, IsNeverBelowTheRms) {
  EXPECT_NEAR(sigma_about(0.0, {{0.96, 0.0, 0.0}, {0.04, 10.0, 0.0}}), 2.0, 1e-12);
}

// A share of the prior probability is 1 over this: none may be 0, a sway's frequency included, which has no grid.
TEST(Variants, EveryEffectWasLookedForAtLeastOnce) {
  for (const Effect& effect : catalogue()) {
    EXPECT_GE(variants(effect, 2940.0 * 3.0), 1.0) << effect.id;
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
