// The top of a smooth likelihood that is costly to ask, over a few positive quantities: Newton's method on their logarithms.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace selfcal {

struct NewtonClimb {
  double first_step = 0.7;     // of the logarithms: derivatives are differences over it, smaller where the steps are
  double last_step = 0.25;     // with differences over no more than this it may end
  double enough = 0.05;        // of the log likelihood: where the next step promises no more the top is reached
  double farthest = HUGE_VAL;  // by such a factor at most from where a quantity began
  int most_rounds = 8;
};

template <int N>
struct NewtonTop {
  std::array<double, N> at;
  double log_likelihood = 0.0;
  Eigen::Matrix<double, N, N> information;  // of the logarithms, as the last differences show it
};

// From `start`, all positive. Asks 1 + N (N + 3) / 2 times a round, some three rounds from within a factor of two.
template <int N>
NewtonTop<N> newton_climb(const std::array<double, N>& start, const NewtonClimb& how,
                          const std::function<double(const std::array<double, N>&)>& log_likelihood) {
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;
  const double limit = std::log(how.farthest);
  const auto within = [&](const Vector& y) -> Vector { return y.cwiseMax(-limit).cwiseMin(limit); };
  const auto quantities = [&](const Vector& y) {
    std::array<double, N> x = start;
    for (int k = 0; k < N; ++k) {
      x[static_cast<std::size_t>(k)] *= std::exp(y(k));
    }
    return x;
  };
  struct Point {
    Vector y;
    double value;
  };
  const auto asked = [&](const Vector& y) { return Point{y, log_likelihood(quantities(y))}; };
  Point best = asked(Vector::Zero());
  Matrix information = Matrix::Identity();
  double h = how.first_step;
  for (int round = 0; round < how.most_rounds; ++round) {
    const Point middle = best;
    const auto at = [&](const Vector& y) {
      const Point p = asked(y);
      if (p.value > best.value && within(y) == y) {
        best = p;
      }
      return p.value;
    };
    // A quantity that stands at its limit, and would go beyond, is left there.
    std::array<bool, N> held{};
    Vector slope = Vector::Zero();
    for (int k = 0; k < N; ++k) {
      const double up = at(middle.y + h * Vector::Unit(k));
      held[static_cast<std::size_t>(k)] = std::abs(middle.y(k)) == limit && (up > middle.value) == (middle.y(k) > 0.0);
      if (!held[static_cast<std::size_t>(k)]) {
        const double down = at(middle.y - h * Vector::Unit(k));
        slope(k) = (up - down) / (2.0 * h);
        information(k, k) = (2.0 * middle.value - up - down) / (h * h);
      }
    }
    for (int a = 0; a < N; ++a) {
      for (int b = 0; b < a; ++b) {
        if (held[static_cast<std::size_t>(a)] || held[static_cast<std::size_t>(b)]) {
          information(a, b) = information(b, a) = 0.0;
          continue;
        }
        const double sa = slope(a) < 0.0 ? -1.0 : 1.0, sb = slope(b) < 0.0 ? -1.0 : 1.0;  // the corner that lies uphill
        const double corner = at(middle.y + h * (sa * Vector::Unit(a) + sb * Vector::Unit(b)));
        const double straight =
            middle.value + h * (sa * slope(a) + sb * slope(b)) - 0.5 * h * h * (information(a, a) + information(b, b));
        information(a, b) = information(b, a) = (straight - corner) / (h * h) * sa * sb;
      }
    }
    const Eigen::SelfAdjointEigenSolver<Matrix> axes(information);
    const Vector along = axes.eigenvectors().transpose() * slope;
    const double most = 2.0 * h;  // differences say nothing of what is farther
    Vector step = Vector::Zero();
    double promised = 0.0;
    for (int k = 0; k < N; ++k) {
      const double curvature = axes.eigenvalues()(k);
      if (along(k) != 0.0) {
        step(k) = curvature * most > std::abs(along(k)) ? along(k) / curvature : std::copysign(most, along(k));
        promised += along(k) * step(k) - 0.5 * curvature * step(k) * step(k);
      }
    }
    const Vector there = within(middle.y + axes.eigenvectors() * step);
    const bool ends = promised < how.enough && h <= how.last_step;
    if (there != middle.y) {
      at(there);
    }
    const bool stands = there == middle.y && best.value == middle.value;
    if (ends || (stands && h <= how.last_step)) {
      break;
    }
    if (step.cwiseAbs().maxCoeff() < h || stands || !(best.value > middle.value)) {
      h = std::max(h / 3.0, 0.1);
    }
  }
  return {quantities(best.y), best.value, information};
}

}  // namespace selfcal
