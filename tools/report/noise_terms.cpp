#include "tools/report/noise_terms.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace selfcal::report {
namespace {

// Five slopes describe an instrument to some hundredths: a quantum that the Earth's rotation walks through in even
// steps, or a filter in the sensor, bends the short averaging times, where the data are many, off any slope. No point
// weighs more than one known to this.
constexpr double most_freedom = 2.0 / (0.05 * 0.05);  // 5 % of the variance, 2.5 % of the deviation
constexpr double octave = 1.9;                        // the points lie ten a decade: every third
constexpr int iterations = 60;
constexpr double settled = 1e-10;  // relative change of the model that ends the iteration

struct Observed {
  Eigen::VectorXd tau, variance, freedom;
};

// Factor of the squared coefficient in the Allan variance.
double basis(NoiseTerm term, double tau) {
  switch (term) {
    case NoiseTerm::quantisation: return 3.0 / (tau * tau);
    case NoiseTerm::random_walk: return 1.0 / tau;
    case NoiseTerm::bias_instability: return 2.0 * std::numbers::ln2 / std::numbers::pi;
    case NoiseTerm::rate_random_walk: return tau / 3.0;
    case NoiseTerm::ramp: break;
  }
  return 0.5 * tau * tau;
}

Observed observe(const std::vector<AllanPoint>& points, std::size_t sensor) {
  Observed seen;
  const auto most = static_cast<Eigen::Index>(points.size());
  seen.tau.resize(most);
  seen.variance.resize(most);
  seen.freedom.resize(most);
  Eigen::Index count = 0;
  for (const AllanPoint& point : points) {
    const double variance = point.deviation[sensor] * point.deviation[sensor];
    const bool next = count == 0 || point.tau_s >= octave * seen.tau[count - 1];
    if (next && variance > 0.0 && std::isfinite(variance) && point.freedom > 0.0) {
      seen.tau[count] = point.tau_s;
      seen.variance[count] = variance;
      seen.freedom[count] = std::min(point.freedom, most_freedom);
      ++count;
    }
  }
  seen.tau.conservativeResize(count);
  seen.variance.conservativeResize(count);
  seen.freedom.conservativeResize(count);
  return seen;
}

struct Solution {
  Eigen::VectorXd square, sigma;  // of each term: coefficient squared
  double bic = std::numeric_limits<double>::infinity();
  double misfit = 0.0;
};

// Fisher scoring of the gamma likelihood: least squares weighted by freedom / (2 model^2). False where a term is not
// positive or not supported.
bool solve(const Observed& seen, const std::vector<NoiseTerm>& terms, Solution& solution) {
  const Eigen::Index points = seen.tau.size();
  const auto count = static_cast<Eigen::Index>(terms.size());
  if (points <= count) {
    return false;
  }
  Eigen::MatrixXd columns(points, count);
  for (Eigen::Index row = 0; row < points; ++row) {
    for (Eigen::Index k = 0; k < count; ++k) {
      columns(row, k) = basis(terms[static_cast<std::size_t>(k)], seen.tau[row]);
    }
  }
  Eigen::VectorXd model = seen.variance;
  Eigen::MatrixXd weighted;
  for (int step = 0; step < iterations; ++step) {
    const Eigen::VectorXd root = (seen.freedom.array() / 2.0).sqrt() / model.array();
    weighted = root.asDiagonal() * columns;
    const Eigen::VectorXd scale = weighted.colwise().norm().cwiseInverse();
    weighted *= scale.asDiagonal();
    const Eigen::VectorXd observed = root.cwiseProduct(seen.variance);
    const Eigen::MatrixXd inverse = (weighted.transpose() * weighted).inverse();
    solution.square = scale.asDiagonal() * (inverse * (weighted.transpose() * observed));
    solution.sigma = scale.cwiseProduct(inverse.diagonal().cwiseSqrt());
    const Eigen::VectorXd next = columns * solution.square;
    if (!next.allFinite() || next.minCoeff() <= 0.0) {
      return false;
    }
    const double change = ((next - model).array() / next.array()).abs().maxCoeff();
    model = next;
    if (change < settled) {
      break;
    }
  }
  if ((solution.square.array() <= support_sigma * solution.sigma.array()).any()) {
    return false;
  }
  const Eigen::ArrayXd ratio = seen.variance.array() / model.array();
  const double deviance = (seen.freedom.array() * (model.array().log() + ratio)).sum();
  solution.bic = deviance + static_cast<double>(count) * std::log(static_cast<double>(points));
  const double chi_squared = (seen.freedom.array() / 2.0 * (ratio - 1.0).square()).sum();
  solution.misfit = chi_squared / static_cast<double>(points - count);
  return true;
}

}  // namespace

double slope_of(NoiseTerm term) { return 0.5 * (static_cast<double>(term) - 2.0); }

double deviation_of(const NoiseTermFit& fit, double tau_s) {
  return fit.coefficient * std::sqrt(basis(fit.term, tau_s));
}

NoiseFit fit_noise_terms(const std::vector<AllanPoint>& points, std::size_t sensor) {
  const Observed seen = observe(points, sensor);
  NoiseFit best;
  Solution least;
  std::vector<NoiseTerm> chosen;
  for (unsigned set = 1; set < (1U << noise_term_count); ++set) {
    std::vector<NoiseTerm> terms;
    for (unsigned k = 0; k < noise_term_count; ++k) {
      if ((set >> k & 1U) != 0) {
        terms.push_back(static_cast<NoiseTerm>(k));
      }
    }
    Solution solution;
    if (solve(seen, terms, solution) && solution.bic < least.bic) {
      least = solution;
      chosen = terms;
    }
  }
  const double widened = std::sqrt(std::max(1.0, least.misfit));
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double coefficient = std::sqrt(least.square[row]);  // half as uncertain, relatively, as its square
    best.terms.push_back({chosen[k], coefficient, widened * least.sigma[row] / (2.0 * coefficient)});
  }
  best.misfit = least.misfit;
  return best;
}

}  // namespace selfcal::report
