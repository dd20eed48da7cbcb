#include "estimator/diagnosis/regression/innovation_colour.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace selfcal::diagnosis {
namespace {

constexpr Eigen::Index axes = 3;
constexpr std::size_t most_lags = 12;
constexpr std::size_t least_epochs = 200;
constexpr std::size_t least_of_segment = 8;  // a shorter one is little beside its mean and slope

// The stretches of epochs that belong together: [first, last).
struct Stretch {
  std::size_t first = 0, last = 0;
  std::size_t size() const { return last - first; }
};

std::vector<Stretch> stretches_of(const std::vector<std::size_t>& segment) {
  std::vector<Stretch> all;
  for (std::size_t k = 0; k < segment.size(); ++k) {
    if (k == 0 || segment[k] != segment[k - 1]) {
      all.push_back({k, k});
    }
    all.back().last = k + 1;
  }
  std::erase_if(all, [](const Stretch& s) { return s.size() < least_of_segment; });
  return all;
}

// x less mean and slope.
std::vector<double> about_line(const Eigen::VectorXd& innovations, Eigen::Index axis, const Stretch& s) {
  const auto n = static_cast<double>(s.size());
  double mean = 0.0, slope = 0.0, square = 0.0;
  std::vector<double> x(s.size());
  for (std::size_t k = 0; k < s.size(); ++k) {
    x[k] = innovations(axes * static_cast<Eigen::Index>(s.first + k) + axis);
    mean += x[k] / n;
  }
  for (std::size_t k = 0; k < s.size(); ++k) {
    const double t = static_cast<double>(k) - 0.5 * (n - 1.0);
    slope += t * x[k];
    square += t * t;
  }
  for (std::size_t k = 0; k < s.size(); ++k) {
    x[k] -= mean + slope / square * (static_cast<double>(k) - 0.5 * (n - 1.0));
  }
  return x;
}

// Autocovariances at lags 0 to most_lags, each over the pairs that lie in one stretch. The line takes two of a stretch's degrees of
// freedom, from every lag alike to first order.
std::vector<double> autocovariances(const Eigen::VectorXd& innovations, Eigen::Index axis,
                                    const std::vector<Stretch>& stretches) {
  std::vector<double> sum(most_lags + 1, 0.0), pairs(most_lags + 1, 0.0);
  double lines = 0.0, epochs = 0.0;
  for (const Stretch& s : stretches) {
    const std::vector<double> x = about_line(innovations, axis, s);
    lines += 2.0;
    epochs += static_cast<double>(s.size());
    for (std::size_t lag = 0; lag <= most_lags; ++lag) {
      for (std::size_t k = lag; k < x.size(); ++k) {
        sum[lag] += x[k] * x[k - lag];
        pairs[lag] += 1.0;
      }
    }
  }
  const double variance = sum[0] / (epochs - lines);
  std::vector<double> c(most_lags + 1);
  for (std::size_t lag = 0; lag <= most_lags; ++lag) {
    c[lag] = pairs[lag] > 0.0 ? sum[lag] / pairs[lag] + variance * lines / epochs : 0.0;
  }
  return c;
}

// Levinson's recursion; the order with the least of Schwarz's criterion.
AxisColour autoregression(const std::vector<double>& c, double epochs) {
  AxisColour best{{}, std::sqrt(c[0]), std::sqrt(c[0])};
  double least = epochs * std::log(c[0]), variance = c[0];
  std::vector<double> phi;
  for (std::size_t order = 1; order < c.size(); ++order) {
    double next = c[order];
    for (std::size_t i = 0; i < phi.size(); ++i) {
      next -= phi[i] * c[order - 1 - i];
    }
    next /= variance;
    if (!(std::abs(next) < 1.0)) {
      break;
    }
    std::vector<double> longer = phi;
    for (std::size_t i = 0; i < phi.size(); ++i) {
      longer[i] -= next * phi[phi.size() - 1 - i];
    }
    longer.push_back(next);
    phi = std::move(longer);
    variance *= 1.0 - next * next;
    const double criterion = epochs * std::log(variance) + std::log(epochs) * static_cast<double>(order);
    if (criterion < least) {
      least = criterion;
      best.phi = phi;
      best.sigma = std::sqrt(variance);
    }
  }
  return best;
}

// Autocovariances of noise whose spectrum is that of `a`, and nowhere below that of white noise of unit variance.
std::vector<double> not_below_white(const AxisColour& a) {
  constexpr int bins = 512;
  std::vector<double> c(most_lags + 1, 0.0);
  for (int bin = 0; bin < bins; ++bin) {
    const double omega = std::numbers::pi * (bin + 0.5) / bins;
    std::complex<double> response = 1.0;
    for (std::size_t i = 0; i < a.phi.size(); ++i) {
      response -= a.phi[i] * std::polar(1.0, -omega * static_cast<double>(i + 1));
    }
    const double density = std::max(1.0, a.sigma * a.sigma / std::norm(response));
    for (std::size_t lag = 0; lag <= most_lags; ++lag) {
      c[lag] += density * std::cos(omega * static_cast<double>(lag)) / bins;
    }
  }
  return c;
}

}  // namespace

bool is_white(const InnovationColour& colour) {
  return std::all_of(colour.begin(), colour.end(),
                     [](const AxisColour& a) { return a.phi.empty() && a.sigma == 1.0 && a.spread == 1.0; });
}

InnovationColour colour_of(const Eigen::VectorXd& innovations, const std::vector<std::size_t>& segment) {
  const std::vector<Stretch> stretches = stretches_of(segment);
  std::size_t epochs = 0;
  for (const Stretch& s : stretches) {
    epochs += s.size();
  }
  InnovationColour colour;
  if (epochs < least_epochs) {
    return colour;
  }
  for (Eigen::Index axis = 0; axis < axes; ++axis) {
    const std::vector<double> c = autocovariances(innovations, axis, stretches);
    if (c[0] > 0.0) {
      const auto n = static_cast<double>(epochs);
      colour[static_cast<std::size_t>(axis)] = autoregression(not_below_white(autoregression(c, n)), n);
    }
  }
  return colour;
}

void whiten(const InnovationColour& colour, Eigen::Ref<Eigen::MatrixXd> rows) {
  // From the last row backwards, so that those before are still as they were.
  for (Eigen::Index row = rows.rows() - 1; row >= 0; --row) {
    const AxisColour& a = colour[static_cast<std::size_t>(row % axes)];
    const auto order = static_cast<Eigen::Index>(a.phi.size());
    if (row / axes < order) {
      rows.row(row) /= a.spread;
      continue;
    }
    for (Eigen::Index i = 0; i < order; ++i) {
      rows.row(row) -= a.phi[static_cast<std::size_t>(i)] * rows.row(row - axes * (i + 1));
    }
    rows.row(row) /= a.sigma;
  }
}

Eigen::VectorXd with_colour(const InnovationColour& colour, const Eigen::VectorXd& white) {
  Eigen::VectorXd x(white.size());
  for (Eigen::Index row = 0; row < white.size(); ++row) {
    const AxisColour& a = colour[static_cast<std::size_t>(row % axes)];
    const auto order = static_cast<Eigen::Index>(a.phi.size());
    if (row / axes < order) {
      x(row) = a.spread * white(row);
      continue;
    }
    x(row) = a.sigma * white(row);
    for (Eigen::Index i = 0; i < order; ++i) {
      x(row) += a.phi[static_cast<std::size_t>(i)] * x(row - axes * (i + 1));
    }
  }
  return x;
}

double log_determinant(const InnovationColour& colour, Eigen::Index rows) {
  double sum = 0.0;
  for (Eigen::Index axis = 0; axis < axes; ++axis) {
    const AxisColour& a = colour[static_cast<std::size_t>(axis)];
    const Eigen::Index epochs = rows / axes, first = std::min(epochs, static_cast<Eigen::Index>(a.phi.size()));
    sum -= static_cast<double>(first) * std::log(a.spread) + static_cast<double>(epochs - first) * std::log(a.sigma);
  }
  return sum;
}

double whitened_gain(const InnovationColour& colour, Eigen::VectorXd& rows) {
  const double square = rows.squaredNorm();
  whiten(colour, rows);
  return 0.5 * (square - rows.squaredNorm()) + log_determinant(colour, rows.size());
}

}  // namespace selfcal::diagnosis
