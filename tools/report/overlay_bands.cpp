#include "tools/report/overlay_bands.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::report {
namespace {

constexpr double normal_95 = 1.959964;
constexpr std::size_t enough = 8;  // parts whose scatter tells a variance

// Asymptotic series (Abramowitz and Stegun 6.3.18, 6.4.12); below 5 the recurrence leads there.
double digamma_less_log(double x) {
  double sum = 0.0, y = x;
  while (y < 5.0) {
    sum -= 1.0 / y;
    y += 1.0;
  }
  return sum + std::log(y) - std::log(x) - 1.0 / (2.0 * y) - 1.0 / (12.0 * y * y) + 1.0 / (120.0 * std::pow(y, 4));
}
double trigamma(double x) {
  double sum = 0.0, y = x;
  while (y < 5.0) {
    sum += 1.0 / (y * y);
    y += 1.0;
  }
  return sum + 1.0 / y + 1.0 / (2.0 * y * y) + 1.0 / (6.0 * y * y * y) - 1.0 / (30.0 * std::pow(y, 5));
}

}  // namespace

OverlayPoint ratio_point(double x, double recording, double simulation, double freedom_recording,
                         double freedom_simulation, double least_variance) {
  const double mean = digamma_less_log(0.5 * freedom_recording) - digamma_less_log(0.5 * freedom_simulation);
  const double sigma =
      std::sqrt(std::max(least_variance, trigamma(0.5 * freedom_recording) + trigamma(0.5 * freedom_simulation)));
  OverlayPoint p{x,
                 recording,
                 simulation,
                 simulation * std::exp(mean - normal_95 * sigma),
                 simulation * std::exp(mean + normal_95 * sigma),
                 0.0};
  p.sigma = (std::log(recording / simulation) - mean) / sigma;
  return p;
}

OverlayPoint difference_point(double x, double recording, double simulation, double variance) {
  const double sigma = std::sqrt(variance);
  return {x,
          recording,
          simulation,
          simulation - normal_95 * sigma,
          simulation + normal_95 * sigma,
          (recording - simulation) / sigma};
}

double mean_of(const std::vector<Part>& parts) {
  Part all;
  for (const Part& p : parts) {
    all.sum += p.sum;
    all.count += p.count;
  }
  return all.count > 0.0 ? all.sum / all.count : 0.0;
}

double variance_of_mean(const std::vector<Part>& parts) {
  if (parts.size() < enough) {
    return 0.0;
  }
  const double mean = mean_of(parts);
  double square = 0.0, count = 0.0;
  for (const Part& p : parts) {
    square += (p.sum - mean * p.count) * (p.sum - mean * p.count);
    count += p.count;
  }
  const auto n = static_cast<double>(parts.size());
  return square / (count * count) * n / (n - 1.0);
}

double scatter_of(const std::vector<Part>& recording, const std::vector<Part>& simulation) {
  const double a = mean_of(recording), b = mean_of(simulation);
  if (recording.size() != simulation.size() || recording.size() < enough || !(a > 0.0) || !(b > 0.0)) {
    return 0.0;
  }
  double count_a = 0.0, count_b = 0.0;
  for (std::size_t k = 0; k < recording.size(); ++k) {
    count_a += recording[k].count;
    count_b += simulation[k].count;
  }
  // What each pair adds to ln a - ln b, beyond its share of a difference that all have.
  double square = 0.0;
  const auto n = static_cast<double>(recording.size());
  for (std::size_t k = 0; k < recording.size(); ++k) {
    const double own = (recording[k].sum / a - recording[k].count) / count_a;
    const double other = (simulation[k].sum / b - simulation[k].count) / count_b;
    square += (own - other) * (own - other);
  }
  return square * n / (n - 1.0);
}

}  // namespace selfcal::report
