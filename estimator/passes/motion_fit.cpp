#include "estimator/passes/motion_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace selfcal {
namespace {

constexpr double largest_radius = 0.99999;
constexpr Eigen::Index slow_half_window = 30;   // epochs of 1 s
constexpr int weighting_rounds = 30;

double pole_radius(const Eigen::VectorXd& a) {
  const Eigen::Index p = a.size();
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(p, p);
  companion.row(0) = a.transpose();
  companion.bottomLeftCorner(p - 1, p - 1).setIdentity();
  return companion.eigenvalues().cwiseAbs().maxCoeff();
}

// Normal equations of one axis over both directions of prediction.
struct Prediction {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  double power = 0.0;
  double count = 0.0;

  Prediction(const Eigen::VectorXd& series, int order)
      : normal(Eigen::MatrixXd::Zero(order, order)), right(Eigen::VectorXd::Zero(order)) {
    for (Eigen::Index k = order; k < series.size(); ++k) {
      const Eigen::VectorXd past = series.segment(k - order, order).reverse();
      const Eigen::VectorXd future = series.segment(k - order + 1, order);
      normal += past * past.transpose() + future * future.transpose();
      right += past * series(k) + future * series(k - order);
      power += series(k) * series(k) + series(k - order) * series(k - order);
    }
    count = 2.0 * static_cast<double>(series.size() - order);
  }
  // Mean square of the prediction error; what is left of a pure line is rounding.
  double error(const Eigen::VectorXd& a) const {
    return std::max(power - 2.0 * a.dot(right) + a.dot(normal * a), 1e-14 * power) / count;
  }
};

// The series less its mean under a Hann window of 2 half + 1, which passes nothing faster than the window is long.
Eigen::VectorXd without_slow(const Eigen::VectorXd& series, Eigen::Index half) {
  Eigen::VectorXd window(2 * half + 1);
  for (Eigen::Index i = -half; i <= half; ++i) {
    window(i + half) = 1.0 + std::cos(std::numbers::pi * static_cast<double>(i) / static_cast<double>(half + 1));
  }
  window /= window.sum();
  Eigen::VectorXd fast(series.size() - 2 * half);
  for (Eigen::Index k = 0; k < fast.size(); ++k) {
    fast(k) = series(k + half) - window.dot(series.segment(k, window.size()));
  }
  return fast;
}

Eigen::VectorXd pooled_coefficients(const std::vector<Prediction>& axes, Eigen::Index order) {
  Eigen::VectorXd a = Eigen::VectorXd::Zero(order);
  for (int round = 0; round < weighting_rounds; ++round) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(order, order);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(order);
    for (const Prediction& axis : axes) {
      if (axis.power > 0.0) {
        const double weight = 1.0 / axis.error(a);   // at first by the power of the axis
        normal += weight * axis.normal;
        right += weight * axis.right;
      }
    }
    normal.diagonal().array() += 1e-13 * normal.trace();
    a = normal.ldlt().solve(right);
  }
  const double radius = pole_radius(a);
  if (radius > largest_radius) {   // z -> z * radius_allowed / radius
    double factor = 1.0;
    for (double& coefficient : a) {
      factor *= largest_radius / radius;
      coefficient *= factor;
    }
  }
  return a;
}

}  // namespace

std::array<MotionModel, 3> fit_motion(const Eigen::Matrix<double, Eigen::Dynamic, 3>& series, int order) {
  const Eigen::Index half = std::min(slow_half_window, (series.rows() - 2 * order) / 4);
  std::vector<Prediction> axes;
  for (int axis = 0; axis < 3; ++axis) {
    axes.emplace_back(without_slow(series.col(axis), half), order);
  }
  const Eigen::VectorXd a = pooled_coefficients(axes, order);
  std::array<MotionModel, 3> motion;
  for (std::size_t axis = 0; axis < motion.size(); ++axis) {
    const auto column = series.col(static_cast<Eigen::Index>(axis));
    motion[axis].coefficients = a;
    motion[axis].innovation_sigma = std::sqrt(axes[axis].error(a));
    motion[axis].sigma = std::sqrt(column.squaredNorm() / static_cast<double>(series.rows()));
  }
  return motion;
}

}  // namespace selfcal
