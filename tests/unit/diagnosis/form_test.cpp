// Forms that a named effect may take beside its equation, on linear models of a few columns whose answers are on paper.
//
// One form of length |q| = L (sigmas, at its full size) and a misfit of s of it: b = q'r = s L^2, J = L^2. Marginalised with
// sigma v it takes -2 log likelihood down by v^2 b^2 / (1 + v^2 J) - log(1 + v^2 J), and its mean is v^2 b / (1 + v^2 J).
#include "estimator/diagnosis/search/form.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/diagnosis/effects/catalogue.hpp"

namespace selfcal::diagnosis {
namespace {

// Three columns at right angles: a named effect of 100 sigma, a form of it of length `length`, something else of length 10.
SignatureRows rows_of(double length, double form_size, double else_size) {
  SignatureRows rows;
  rows.columns = Eigen::MatrixXd::Zero(4, 3);
  rows.columns(0, 0) = 100.0;
  rows.columns(1, 1) = length;
  rows.columns(2, 2) = 10.0;
  rows.residual = rows.columns * Eigen::Vector3d(1.0, form_size, else_size);
  return rows;
}

FormFamily family(double most) { return {FormKind::in_turns, 0, most, {1}}; }

TEST(Forms, OfARightEquationStayClosed) {
  EXPECT_TRUE(open_forms(Evidence(rows_of(50.0, 0.0, 0.0)), {family(0.05)}, {0}).empty());
  // A form of 2 sigma is chance: 4 is less than the 9 that a family must gain.
  EXPECT_TRUE(open_forms(Evidence(rows_of(50.0, 2.0 / 50.0, 0.0)), {family(0.05)}, {0}).empty());
}

// 5 % of a form that is 5 sigma long is a quarter of a sigma: whatever is seen there is not that effect's form.
TEST(Forms, OfAWeakEffectHaveNoRoom) {
  const OpenForms open = open_forms(Evidence(rows_of(5.0, 1.0, 0.0)), {family(0.05)}, {0});
  for (const FormFamily& f : open.families) {
    // At the largest scale, 15 %, v^2 J = 0.5625: the mean is 0.36 of what is there.
    EXPECT_LE(f.scale, 3.0);
    EXPECT_LT(std::abs(open.mean(0)), 0.361);
  }
}

TEST(Forms, OfAStrongEffectAreTakenUp) {
  const double s = 0.1, L = 200.0;
  const OpenForms open = open_forms(Evidence(rows_of(L, s, 0.0)), {family(0.05)}, {0});
  ASSERT_EQ(open.families.size(), 1u);
  // The greatest likelihood of one sample of size s is at v = s: of 0.005, 0.015, 0.05, 0.15 the nearest in the logarithm is 0.15 or 0.05.
  const double v = open.sigma(0);
  EXPECT_TRUE(v == 0.05 || std::abs(v - 0.15) < 1e-12) << v;
  EXPECT_NEAR(open.mean(0), s * v * v * L * L / (1.0 + v * v * L * L), 1e-9);
  EXPECT_NEAR(open.covariance(0, 0), v * v / (1.0 + v * v * L * L), 1e-12);
  EXPECT_NEAR(open.square, s * s * L * L, 0.02 * s * s * L * L);  // all of it but for the shrinkage
}

// What is no form of the effect stays what it was: at right angles nothing is taken from it.
TEST(Forms, TakeNothingFromWhatIsNoForm) {
  const Evidence evidence(rows_of(200.0, 0.1, 1.0));
  const OpenForms open = open_forms(evidence, {family(0.05)}, {0});
  Evidence given = evidence;
  given.marginalise(open.columns, open.sigma.cwiseAbs2().asDiagonal());
  EXPECT_NEAR(test_group(given, {2}, {0}).delta_chi2, 100.0, 1e-9);
  // Of the form itself next to nothing is left to be named once more.
  EXPECT_LT(test_group(given, {1}, {0}).delta_chi2, 1.1);
}

TEST(Forms, EveryEffectOfTheSensorsHasSome) {
  for (const Effect& e : catalogue()) {
    const Candidate named{&e, e.constant.tried().empty() ? 1.0 : e.constant.tried().front(), 0,
                          static_cast<int>(e.parameters.size())};
    if (e.sensor == nullptr) {
      EXPECT_TRUE(forms_of(named).empty()) << e.id;
      continue;
    }
    for (const FormCandidate& form : forms_of(named)) {
      EXPECT_EQ(form.candidate.effect, &e);
      EXPECT_GT(form.most, 0.0);
      EXPECT_LE(form.most, 1.0);
      // A form is another constant, or a factor: never the effect itself.
      EXPECT_TRUE(form.candidate.modulation != nullptr || form.candidate.constant != named.constant) << e.id;
    }
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
