#include "estimator/diagnosis/regression/regression.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal::diagnosis {

namespace {

// Directions below it are invisible.
double least_eigenvalue(const Eigen::VectorXd& eigenvalues, double most) {
  return std::max(1.0 / (most * most), 1e-10 * eigenvalues(eigenvalues.size() - 1));
}

}  // namespace

Eigen::MatrixXd visible_root(const Eigen::MatrixXd& information, double most) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const double floor = least_eigenvalue(eigen.eigenvalues(), most);
  const Eigen::Index hidden = (eigen.eigenvalues().array() <= floor).count();  // they come first
  const Eigen::Index seen = information.rows() - hidden;
  return eigen.eigenvalues().tail(seen).cwiseSqrt().cwiseInverse().asDiagonal() *
         eigen.eigenvectors().rightCols(seen).transpose();
}

double sigma_about(double centre, const std::vector<Share>& shares) {
  constexpr double of_95_percent = 1.959964;
  double weight = 0.0, square = 0.0;
  for (const Share& s : shares) {
    weight += s.weight;
    square += s.weight * (s.sigma * s.sigma + (s.mean - centre) * (s.mean - centre));
  }
  const double rms = std::sqrt(square / weight);
  const auto held = [&](double half) {
    double sum = 0.0;
    for (const Share& s : shares) {
      const double off = s.mean - centre;
      // P(|x| <= half), x ~ N(off, sigma^2).
      const double p = s.sigma > 0.0 ? 0.5 * (std::erf((half - off) / (std::numbers::sqrt2 * s.sigma)) +
                                              std::erf((half + off) / (std::numbers::sqrt2 * s.sigma)))
                                     : (std::abs(off) <= half ? 1.0 : 0.0);
      sum += s.weight * p;
    }
    return sum / weight;
  };
  double low = of_95_percent * rms, high = low;
  if (held(low) >= 0.95) {
    return rms;
  }
  while (held(high) < 0.95) {  // at 4.5 rms at the latest (Chebyshev)
    high *= 1.5;
  }
  for (int step = 0; step < 50; ++step) {
    const double middle = 0.5 * (low + high);
    (held(middle) < 0.95 ? low : high) = middle;
  }
  return high / of_95_percent;
}

Eigen::LDLT<Eigen::MatrixXd> solver_beside(Eigen::MatrixXd information) {
  constexpr double widest = 1000.0;
  information.diagonal().array() += 1.0 / (widest * widest);
  return Eigen::LDLT<Eigen::MatrixXd>(information);
}

Fit fit_columns(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, double most) {
  Fit fit;
  const Eigen::Index n = score.size();
  const double prior = 1.0 / (most * most);
  if (n == 0) {
    return fit;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const double floor = least_eigenvalue(eigen.eigenvalues(), most);
  const Eigen::VectorXd rotated = eigen.eigenvectors().transpose() * score;
  Eigen::VectorXd solved = Eigen::VectorXd::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (eigen.eigenvalues()(k) > floor) {
      solved(k) = rotated(k) / eigen.eigenvalues()(k);
      fit.delta_chi2 += rotated(k) * solved(k);
      ++fit.rank;
    }
  }
  fit.value = eigen.eigenvectors() * solved;
  fit.covariance = eigen.eigenvectors() *
                   (eigen.eigenvalues().cwiseMax(0.0).array() + prior).inverse().matrix().asDiagonal() *
                   eigen.eigenvectors().transpose();
  return fit;
}

}  // namespace selfcal::diagnosis
