// Tests on the rows of a signature pass: which columns explain the residuals, one group at a time, given others.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "estimator/diagnosis/regression/regression.hpp"
#include "estimator/diagnosis/regression/signature_pass.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {

// Of some columns only.
struct Normal {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
};

// Normal equations of residual = columns * size + unit noise.
struct Evidence {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  double square = 0.0;  // of the residuals
  double rows = 0.0;

  Evidence() = default;
  explicit Evidence(const SignatureRows& rows);
  // Adds back what a correction had already taken out: columns `at`, sizes in typical sizes.
  void restore(const std::vector<int>& at, const Eigen::VectorXd& size);
  // Further columns N: Z^T N, N^T N and N^T times the residuals.
  void append(const Eigen::MatrixXd& with_others, const Eigen::MatrixXd& own, const Eigen::VectorXd& own_score);
  // Columns `at` become random, ~ N(0, covariance), and are integrated out.
  void marginalise(const std::vector<int>& at, const Eigen::MatrixXd& covariance);

  Fit fit(const std::vector<int>& columns) const;
  // `columns` with those of `others` projected out.
  Normal given(const std::vector<int>& columns, const std::vector<int>& others) const;
};

// A coefficient with less information than this per typical size squared is not seen.
constexpr double least_information = 1e-5;

struct GroupTest {
  double delta_chi2 = 0.0;  // fall of the residuals' square
  int rank = 0;
  double log_p = 0.0;          // of the group: whole group and best single column, corrected for looking at both
  double log_detection = 0.0;  // the smaller of both, not corrected: for effective_tests, and for rivals the above
  double expected_z = 0.0;     // of its best single coefficient at typical size
};
// `group` given that `others` are fitted too.
GroupTest test_group(const Evidence& evidence, const std::vector<int>& group, const std::vector<int>& others);

// Cross-validated gain in log-likelihood: every fold's rows predicted by a fit to the rest, with `full` against
// `reduced` columns. `fold` gives each row's number.
double held_out_gain(const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual, const std::vector<int>& fold,
                     const std::vector<int>& full, const std::vector<int>& reduced);

// A line is looked for at every frequency that so many rows (three axes) tell apart.
inline double searched_frequencies(double rows) { return std::max(1.0, rows / 6.0); }
// So many constants of an effect were looked at: those of its grid, or the frequencies of a spectrum. At least 1.
inline double variants(const Effect& effect, double rows) {
  return effect.constant.kind == EffectConstant::Kind::spectrum ? searched_frequencies(rows)
                                                                : static_cast<double>(effect.constant.tried().size());
}

}  // namespace selfcal::diagnosis
