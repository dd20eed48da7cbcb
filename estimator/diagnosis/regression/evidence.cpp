#include "estimator/diagnosis/regression/evidence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {
namespace {

std::vector<int> joined(std::vector<int> a, const std::vector<int>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

Evidence::Evidence(const SignatureRows& r)
    : information(r.columns.transpose() * r.columns),
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

RandomWalk test_walk(const Evidence& e, const std::vector<LocatedColumn>& map, int first_map_column, int axis,
                     const std::vector<int>& others) {
  RandomWalk test;
  test.axis = axis;
  std::vector<double> time_h;
  std::vector<int> columns;
  for (std::size_t k = 0; k < map.size(); ++k) {
    const bool segment = map[k].kind == LocatedColumn::Kind::dwell || map[k].kind == LocatedColumn::Kind::rotation;
    if (map[k].axis == axis && segment) {
      test.places.push_back(static_cast<int>(k));
      columns.push_back(first_map_column + static_cast<int>(k));
      time_h.push_back(0.5 * (map[k].start_s + map[k].end_s) / 3600.0);
    }
  }
  const Normal given = e.given(columns, others);
  const Eigen::MatrixXd& J = given.information;
  const Eigen::VectorXd& b = given.score;
  const auto n = static_cast<Eigen::Index>(time_h.size());
  Eigen::MatrixXd K(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      K(i, j) = std::min(time_h[static_cast<std::size_t>(i)], time_h[static_cast<std::size_t>(j)]);
    }
  }
  const auto twice_log_likelihood = [&](double q) {
    const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(n, n) + q * J * K;
    const Eigen::PartialPivLU<Eigen::MatrixXd> lu(M);
    return q * b.dot(K * lu.solve(b)) - lu.matrixLU().diagonal().cwiseAbs().array().log().sum();
  };
  constexpr int steps_per_decade = 8, first_decade = -4, last_decade = 8;
  double best_q = 0.0;
  for (int step = first_decade * steps_per_decade; step <= last_decade * steps_per_decade; ++step) {
    const double q = std::pow(10.0, static_cast<double>(step) / steps_per_decade);
    const double value = twice_log_likelihood(q);
    if (value > test.delta_chi2) {
      test.delta_chi2 = value;
      best_q = q;
    }
  }
  test.rate = std::sqrt(best_q);
  if (best_q > 0.0) {  // curvature in the logarithm of the rate
    const double h = 0.1;
    const double around = twice_log_likelihood(best_q * std::exp(2.0 * h)) +
                          twice_log_likelihood(best_q * std::exp(-2.0 * h)) - 2.0 * test.delta_chi2;
    test.sigma = test.rate / std::sqrt(std::max(-0.5 * around / (h * h), 1.0));
  }
  test.covariance = best_q * K;
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
