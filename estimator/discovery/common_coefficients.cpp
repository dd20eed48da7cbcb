#include "estimator/discovery/common_coefficients.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace selfcal::discovery {
namespace {

Eigen::MatrixXd stacked(const std::vector<CoefficientPlaces>& coefficients, const std::vector<std::size_t>& some,
                        Eigen::Index size) {
  Eigen::MatrixXd D(0, size);
  for (const std::size_t k : some) {
    if (coefficients[k].places.size() > 1) {
      const Eigen::MatrixXd own = differences(coefficients[k].places, 0, 1, size);
      D.conservativeResize(D.rows() + own.rows(), Eigen::NoChange);
      D.bottomRows(own.rows()) = own;
    }
  }
  return D;
}

double log_p_of(const std::vector<CoefficientPlaces>& coefficients, const std::vector<std::size_t>& some,
                const JointGaussian& all) {
  const Eigen::MatrixXd D = stacked(coefficients, some, all.x.size());
  return D.rows() == 0 ? 0.0 : all.log_p_of_zero(D);
}

void add_differing(std::size_t k, const CoefficientPlaces& c, const JointGaussian& all, CommonCoefficients& result) {
  for (std::size_t i = 1; i < c.places.size(); ++i) {
    const Eigen::Index a = c.places.front(), b = c.places[i];
    const double variance = all.covariance(a, a) - 2.0 * all.covariance(a, b) + all.covariance(b, b);
    result.differing.push_back(
        {static_cast<int>(k), c.recordings[i], all.x(b) - all.x(a), std::sqrt(std::max(0.0, variance))});
  }
}

}  // namespace

CommonCoefficients decide_common(const std::vector<CoefficientPlaces>& coefficients, JointGaussian& all, double rate) {
  std::vector<std::size_t> same(coefficients.size());
  std::iota(same.begin(), same.end(), 0U);
  CommonCoefficients result{log_p_of(coefficients, same, all), std::vector<bool>(coefficients.size(), true), {}};
  double log_p = result.log_p;
  while (log_p <= std::log(rate) && !same.empty()) {
    const auto worst = std::min_element(same.begin(), same.end(), [&](std::size_t a, std::size_t b) {
      return log_p_of(coefficients, {a}, all) < log_p_of(coefficients, {b}, all);
    });
    result.common[*worst] = false;
    same.erase(worst);
    log_p = log_p_of(coefficients, same, all);
  }
  if (const Eigen::MatrixXd D = stacked(coefficients, same, all.x.size()); D.rows() > 0) {
    all.impose(D);
  }
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    if (!result.common[k]) {
      add_differing(k, coefficients[k], all, result);
    }
  }
  return result;
}

}  // namespace selfcal::discovery
