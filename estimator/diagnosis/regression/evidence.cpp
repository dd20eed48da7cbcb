#include "estimator/diagnosis/regression/evidence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {
namespace {

// Z^T Z, of which one half is reckoned.
Eigen::MatrixXd square_of(const Eigen::MatrixXd& Z) {
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(Z.cols(), Z.cols());
  if (Z.size() > 0) {  // BLAS calls a matrix without elements an error, and says so on standard output
    G.selfadjointView<Eigen::Lower>().rankUpdate(Z.transpose());
  }
  return G.selfadjointView<Eigen::Lower>();
}

std::vector<int> joined(std::vector<int> a, const std::vector<int>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

Evidence::Evidence(const SignatureRows& r)
    : information(square_of(r.columns)),
      score(r.columns.transpose() * r.residual),
      square(r.residual.squaredNorm()),
      rows(static_cast<double>(r.residual.size())) {}

void Evidence::restore(const std::vector<int>& at, const Eigen::VectorXd& size) {
  square += 2.0 * size.dot(score(at)) + size.dot(information(at, at) * size);
  score += information(Eigen::all, at) * size;
}

void Evidence::append(const Eigen::MatrixXd& with_others, const Eigen::MatrixXd& own,
                      const Eigen::VectorXd& own_score) {
  const Eigen::Index at = score.size(), count = own_score.size();
  information.conservativeResize(at + count, at + count);
  information.topRightCorner(at, count) = with_others;
  information.bottomLeftCorner(count, at) = with_others.transpose();
  information.bottomRightCorner(count, count) = own;
  score.conservativeResize(at + count);
  score.tail(count) = own_score;
}

// Woodbury: (I + Z C Z^T)^-1 = I - Z (C^-1 + Z^T Z)^-1 Z^T = I - Z C (I + J C)^-1 Z^T.
void Evidence::marginalise(const std::vector<int>& at, const Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd J = information(at, at);
  const auto n = J.rows();
  const Eigen::MatrixXd middle = covariance * (Eigen::MatrixXd::Identity(n, n) + J * covariance).inverse();
  const Eigen::MatrixXd Z = information(Eigen::all, at);
  const Eigen::VectorXd b = score(at);
  information -= Z * middle * Z.transpose();
  score -= Z * (middle * b);
  square -= b.dot(middle * b);
}

Fit Evidence::fit(const std::vector<int>& columns) const {
  return fit_columns(information(columns, columns), score(columns));
}

Normal Evidence::given(const std::vector<int>& columns, const std::vector<int>& others) const {
  Normal left{information(columns, columns), score(columns)};
  if (!others.empty()) {
    const Eigen::MatrixXd X = information(others, columns);
    const Eigen::VectorXd s = score(others);
    const Eigen::LDLT<Eigen::MatrixXd> solver = solver_beside(information(others, others));
    left.information -= X.transpose() * solver.solve(X);
    left.score -= X.transpose() * solver.solve(s);
  }
  return left;
}

GroupTest test_group(const Evidence& e, const std::vector<int>& group, const std::vector<int>& others) {
  const auto [G, b] = e.given(group, others);
  GroupTest test;
  const Fit fit = fit_columns(G, b);
  test.delta_chi2 = fit.delta_chi2;
  test.rank = fit.rank;
  if (fit.rank == 0) {
    return test;
  }
  double best = 0.0;
  for (Eigen::Index k = 0; k < b.size(); ++k) {
    test.expected_z = std::max(test.expected_z, std::sqrt(std::max(G(k, k), 0.0)));
    if (G(k, k) > least_information &&
        G(k, k) > 1e-9 * e.information(group[static_cast<std::size_t>(k)], group[static_cast<std::size_t>(k)])) {
      best = std::max(best, b(k) * b(k) / G(k, k));
    }
  }
  const double alone = log_chi_squared_tail(best, 1.0);
  const double single = log_corrected(alone, static_cast<double>(b.size()));
  test.log_p = log_chi_squared_tail(fit.delta_chi2, fit.rank);
  test.log_detection = std::min(test.log_p, alone);
  if (b.size() > 1) {
    test.log_p = log_corrected(std::min(test.log_p, single), 2.0);
  }
  return test;
}

double held_out_gain(const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual, const std::vector<int>& fold,
                     const std::vector<int>& full, const std::vector<int>& reduced) {
  const std::vector<int> all = joined(full, reduced);
  const int folds = fold.empty() ? 0 : 1 + *std::max_element(fold.begin(), fold.end());
  const Eigen::MatrixXd Z = columns(Eigen::all, all);
  const auto m = Z.cols();
  std::vector<Eigen::MatrixXd> G(static_cast<std::size_t>(folds), Eigen::MatrixXd::Zero(m, m));
  std::vector<Eigen::VectorXd> b(static_cast<std::size_t>(folds), Eigen::VectorXd::Zero(m));
  Eigen::MatrixXd G_all = Eigen::MatrixXd::Zero(m, m);
  Eigen::VectorXd b_all = Eigen::VectorXd::Zero(m);
  for (Eigen::Index r = 0; r < residual.size(); ++r) {
    const auto f = static_cast<std::size_t>(fold[static_cast<std::size_t>(r)]);
    G[f].noalias() += Z.row(r).transpose() * Z.row(r);
    b[f] += Z.row(r).transpose() * residual(r);
  }
  for (int f = 0; f < folds; ++f) {
    G_all += G[static_cast<std::size_t>(f)];
    b_all += b[static_cast<std::size_t>(f)];
  }
  const auto fall = [&](Eigen::Index first, Eigen::Index count, std::size_t f) {
    if (count == 0) {
      return 0.0;
    }
    const Eigen::MatrixXd here = G[f].block(first, first, count, count);
    const Eigen::VectorXd score = b[f].segment(first, count);
    const Fit rest = fit_columns(G_all.block(first, first, count, count) - here, b_all.segment(first, count) - score);
    return 2.0 * rest.value.dot(score) - rest.value.dot(here * rest.value);
  };
  double gain = 0.0;
  const auto n_full = static_cast<Eigen::Index>(full.size());
  for (std::size_t f = 0; f < G.size(); ++f) {
    gain += 0.5 * (fall(0, n_full, f) - fall(n_full, m - n_full, f));
  }
  return gain;
}

}  // namespace selfcal::diagnosis
