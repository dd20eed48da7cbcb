#include "estimator/diagnosis/search/squares.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <vector>

#include "estimator/diagnosis/search/bias_noise.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr int accelerometers = 3;

// One explanation of an accelerometer: b u_j^2 + c u_k^2 + a u_i^2, of which two at most are there.
struct Squares {
  Eigen::Vector2d fitted = Eigen::Vector2d::Zero();  // b - a and c - a
  double own = 0.0;                                  // a
  double half_square = 0.0;                          // of what it leaves
  int coefficients = 0;
  bool others = false;  // b or c is there
};

// As fitted under the constraint n . x = 0.
Squares constrained(const Eigen::Vector2d& x, const Eigen::Matrix2d& covariance, const Eigen::Vector2d& n) {
  const double off = n.dot(x), variance = n.dot(covariance * n);
  Squares s;
  s.fitted = x - covariance * n * (off / variance);
  s.half_square = 0.5 * off * off / variance;
  s.coefficients = 1;
  return s;
}

std::vector<Squares> explanations(const Eigen::Vector2d& x, const Eigen::Matrix2d& covariance) {
  Squares none;
  none.half_square = 0.5 * x.dot(covariance.inverse() * x);
  Squares both{x, 0.0, 0.0, 2, true};
  Squares own_and_first = both, own_and_second = both;
  own_and_first.own = -x(1);
  own_and_second.own = -x(0);
  Squares first = constrained(x, covariance, Eigen::Vector2d::UnitY()),
          second = constrained(x, covariance, Eigen::Vector2d::UnitX()),
          own = constrained(x, covariance, Eigen::Vector2d(1.0, -1.0));
  first.others = second.others = true;
  own.own = -own.fitted(0);
  return {none, first, second, own, both, own_and_first, own_and_second};
}

}  // namespace

SquaresAverage average_squares(const Term& squares, const Eigen::MatrixXd& shift, double rows) {
  constexpr double log_prior_of_a_name = -1.0;
  std::array<std::vector<Squares>, accelerometers> of_axis;
  for (Eigen::Index axis = 0; axis < accelerometers; ++axis) {
    of_axis[static_cast<std::size_t>(axis)] =
        explanations(squares.amplitude.segment<2>(2 * axis), squares.covariance.block<2, 2>(2 * axis, 2 * axis));
  }
  double total = 0.0, own_square = 0.0;
  ParameterVector mean = ParameterVector::Zero();
  ParameterMatrix second_moment = ParameterMatrix::Zero();
  for (const Squares& x : of_axis[0]) {
    for (const Squares& y : of_axis[1]) {
      for (const Squares& z : of_axis[2]) {
        double log_weight = 0.0;
        bool own = false, others = false;
        ParameterVector moved = ParameterVector::Zero();
        Eigen::Index axis = 0;
        for (const Squares* s : {&x, &y, &z}) {
          log_weight -= s->half_square + 0.5 * std::log(rows) * s->coefficients;
          own = own || s->own != 0.0;
          others = others || s->others;
          moved += shift.middleCols(2 * axis, 2) * (s->fitted - squares.amplitude.segment<2>(2 * axis));
          const EffectParameter& unit = squares.effect->parameters[static_cast<std::size_t>(2 * axis)];
          moved(bias_of(accelerometers + static_cast<int>(axis))) -= s->own * unit.typical * unit.si_per_unit;
          ++axis;
        }
        const double weight = std::exp(log_weight + log_prior_of_a_name * ((own ? 1.0 : 0.0) + (others ? 1.0 : 0.0)));
        total += weight;
        own_square += own ? weight : 0.0;
        mean += weight * moved;
        second_moment += weight * moved * moved.transpose();
      }
    }
  }
  SquaresAverage average;
  if (total > 0.0) {
    average.shift = mean / total;
    average.covariance = second_moment / total - average.shift * average.shift.transpose();
    average.own_square = own_square / total;
  }
  return average;
}

}  // namespace selfcal::diagnosis
