// The catalogue's worth in tests, where theory knows it.
#include "estimator/diagnosis/regression/multiplicity.hpp"

#include <gtest/gtest.h>

namespace selfcal::diagnosis {
namespace {

constexpr double alpha = 0.01;

// `count` candidates of one coefficient each; `alike`: all with the same signature.
double worth(int count, bool alike) {
  SignatureRows rows;
  rows.residual = Eigen::VectorXd::Zero(count);
  rows.columns =
      alike ? Eigen::MatrixXd::Constant(count, count, 1.0) : Eigen::MatrixXd(Eigen::MatrixXd::Identity(count, count));
  std::vector<Candidate> candidates;
  for (int k = 0; k < count; ++k) {
    candidates.push_back({nullptr, 0.0, k, 1});
  }
  return effective_tests(Evidence(rows), candidates, alpha);
}

// 10000 draws leave 100 beyond the quantile: 10 % of scatter; 35 % are three of it and a little.
TEST(Multiplicity, IndependentTestsCountEach) {
  for (const int count : {1, 10, 60}) {
    EXPECT_NEAR(worth(count, false) / count, 1.0, 0.35) << count;  // 1 - (1 - p)^n = alpha: n p to 0.5 %
  }
}

TEST(Multiplicity, TestsThatAreAlikeCountOnce) { EXPECT_NEAR(worth(60, true), 1.0, 0.35); }

// One candidate of nine independent coefficients: its group and each of them alone, ten tests that hang together a
// little: more than nine tenths of the nine, fewer than ten.
TEST(Multiplicity, CoefficientsOfAGroupCount) {
  SignatureRows rows;
  rows.residual = Eigen::VectorXd::Zero(9);
  rows.columns = Eigen::MatrixXd::Identity(9, 9);
  const double found = effective_tests(Evidence(rows), {{nullptr, 0.0, 0, 9}}, alpha);
  EXPECT_GT(found, 0.65 * 9.0);
  EXPECT_LT(found, 1.35 * 10.0);
}

}  // namespace
}  // namespace selfcal::diagnosis
