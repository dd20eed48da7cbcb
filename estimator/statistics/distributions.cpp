#include "estimator/statistics/distributions.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal {
namespace {

// 1/(b_0 + a_1/(b_1 + a_2/(b_2 + ...))) by Lentz's method: `term(n)` gives a_n and b_n, a_0 is not asked for.
struct FractionTerm {
  double a = 0.0, b = 0.0;
};
template <typename Terms>
double continued_fraction(const Terms& term) {
  constexpr double tiny = 1e-300;  // in the place of a zero denominator
  constexpr double converged = 1e-14;
  constexpr int most_terms = 1000;
  const auto nonzero = [](double x) { return std::abs(x) < tiny ? tiny : x; };
  double c = 1.0 / tiny, d = 1.0 / nonzero(term(0).b), value = d;
  for (int n = 1; n < most_terms; ++n) {
    const FractionTerm t = term(n);
    d = 1.0 / nonzero(t.a * d + t.b);
    c = nonzero(t.b + t.a / c);
    value *= c * d;
    if (std::abs(c * d - 1.0) < converged) {
      break;
    }
  }
  return value;
}

// log of the incomplete beta function ratio I_x(a, b), for x below (a+1)/(a+b+2).
double log_beta_ratio(double x, double a, double b) {
  const double front =
      std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x) - std::log(a);
  return front + std::log(continued_fraction([&](int n) -> FractionTerm {
           const double m = n / 2;  // NOLINT(bugprone-integer-division): terms come in pairs
           const bool even = n % 2 == 0;
           if (n == 0) {
             return {0.0, 1.0};
           }
           return {even ? m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
                        : -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
                   1.0};
         }));
}

}  // namespace

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
  return front + std::log(continued_fraction([&](int n) -> FractionTerm {
           return {-n * (n - a), x + 1.0 - a + 2.0 * n};
         }));
}

double log_normal_tail(double z) { return log_chi_squared_tail(z * z, 1.0); }

double log_f_tail(double f, double numerator, double denominator) {
  if (f <= 0.0) {
    return 0.0;
  }
  const double x = denominator / (denominator + numerator * f);  // P(F > f) = I_x(denominator/2, numerator/2)
  const double a = 0.5 * denominator, b = 0.5 * numerator;
  if (x < (a + 1.0) / (a + b + 2.0)) {
    return log_beta_ratio(x, a, b);
  }
  return std::log1p(-std::exp(log_beta_ratio(1.0 - x, b, a)));
}

double log_corrected(double log_p, double count) { return std::min(0.0, log_p + std::log(count)); }

double sigma_from_log_p(double log_p) {
  double low = 0.0, high = std::sqrt(std::max(1.0, -2.0 * log_p)) + 1.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (log_normal_tail(middle) > log_p ? low : high) = middle;
  }
  return low;
}

}  // namespace selfcal
