#include "estimator/discovery/constant_spread.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace selfcal::discovery {
namespace {

// Beyond 4 sigma less than 1e-4 of the probability is left; half a sigma apart, sums over a Gaussian are its integrals to 1e-8.
constexpr int steps = 8;  // to either side
constexpr double step = 0.5;
// Where Gauss-Newton knows next to nothing of a constant, values of e^4 to either side.
constexpr double widest_log_sigma = 1.0;

// Values of the constant about the one that is told, which is among them.
std::vector<double> values_about(const LawTerm& term, double sigma) {
  const double told = term.constants.front();
  const double log_sigma = std::min(widest_log_sigma, sigma / told);
  std::vector<double> values;
  for (int k = -steps; k <= steps; ++k) {
    const double value = told * std::exp(step * k * log_sigma);
    if (value >= term.least && value <= term.most) {
      values.push_back(value);
    }
  }
  return values;
}

}  // namespace

ConstantSpread spread_about(double coefficient, double constant, std::span<const SingleFit> fits,
                            std::span<const double> values) {
  const auto best = std::max_element(fits.begin(), fits.end(),
                                     [](const SingleFit& a, const SingleFit& b) { return a.gain < b.gain; });
  double total = 0.0, coefficient_square = 0.0, constant_square = 0.0;
  for (std::size_t j = 0; j < fits.size(); ++j) {
    const double weight = std::exp(0.5 * (fits[j].gain - best->gain));
    total += weight;
    coefficient_square += weight * (std::pow(fits[j].coefficient - coefficient, 2.0) + fits[j].variance);
    constant_square += weight * std::pow(values[j] - constant, 2.0);
  }
  return {std::sqrt(coefficient_square / total), std::sqrt(constant_square / total)};
}

std::optional<ConstantSpread> spread_over_constant(std::span<const LawRecording> recordings, const LawFit& fit,
                                                   std::size_t k, const std::stop_token& stop) {
  const LawTerm& term = fit.terms[k];
  if (term.constants.size() != 1 || !(term.constants.front() > 0.0)) {
    return std::nullopt;
  }
  auto place = static_cast<Eigen::Index>(fit.terms.size());
  std::vector<LawTerm> others;
  for (std::size_t j = 0; j < fit.terms.size(); ++j) {
    place += j < k ? static_cast<Eigen::Index>(fit.terms[j].constants.size()) : 0;
    if (j != k) {
      others.push_back(fit.terms[j]);
    }
  }
  if (term.at_its_limit()) {
    return std::nullopt;
  }
  std::vector<LawTerm> alternatives;
  const std::vector<double> values = values_about(term, std::sqrt(std::max(0.0, fit.covariance(place, place))));
  for (const double value : values) {
    alternatives.push_back(term);
    alternatives.back().constants.front() = value;
  }
  const std::vector<SingleFit> fits = fit_each(recordings, others, alternatives, stop, GivenConstants::free);
  return spread_about(fit.coefficient(static_cast<Eigen::Index>(k)), term.constants.front(), fits, values);
}

}  // namespace selfcal::discovery
