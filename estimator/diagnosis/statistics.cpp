#include "estimator/diagnosis/statistics.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal::diagnosis {

double log_chi_squared_tail(double value, double degrees) {
  const double a = 0.5 * degrees;
  const double x = 0.5 * value;
  if (x <= 0.0 || degrees <= 0.0) {
    return 0.0;
  }
  const double front = -x + a * std::log(x) - std::lgamma(a);
  if (x < a + 1.0) {  // 1 - P by the series
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < 1000 && term > 1e-14 * sum; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return std::log1p(-std::min(std::exp(front) * sum, 1.0 - 1e-15));
  }
  constexpr double tiny = 1e-300;  // Lentz's method
  double b = x + 1.0 - a, c = 1.0 / tiny, d = 1.0 / b, h = d;
  for (int n = 1; n < 1000; ++n) {
    const double an = -n * (n - a);
    b += 2.0;
    d = an * d + b;
    d = std::abs(d) < tiny ? tiny : d;
    c = b + an / c;
    c = std::abs(c) < tiny ? tiny : c;
    d = 1.0 / d;
    const double change = d * c;
    h *= change;
    if (std::abs(change - 1.0) < 1e-13) {
      break;
    }
  }
  return front + std::log(h);
}

double log_corrected(double log_p, double count) { return std::min(0.0, log_p + std::log(count)); }

double sigma_from_log_p(double log_p) {
  double low = 0.0, high = std::sqrt(std::max(1.0, -2.0 * log_p)) + 1.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (log_chi_squared_tail(middle * middle, 1.0) > log_p ? low : high) = middle;
  }
  return low;
}

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
      fit.gain += rotated(k) * solved(k);
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
