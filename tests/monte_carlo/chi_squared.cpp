#include "tests/monte_carlo/chi_squared.hpp"

#include <cmath>

namespace selfcal::monte_carlo {
namespace {

// Inverse of the standard normal distribution by bisection; erfc is good to rounding far into the tails.
double normal_quantile(double probability) {
  double low = -10.0;
  double high = 10.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double chi_squared_quantile(double probability, double degrees) {
  const double t = 2.0 / (9.0 * degrees);
  const double root = 1.0 - t + normal_quantile(probability) * std::sqrt(t);
  return root > 0.0 ? degrees * root * root * root : 0.0;
}

}  // namespace selfcal::monte_carlo
