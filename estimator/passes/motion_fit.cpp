#include "estimator/passes/motion_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace selfcal {
namespace {

constexpr double largest_radius = 0.99999;

double pole_radius(const Eigen::VectorXd& a) {
  const Eigen::Index p = a.size();
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(p, p);
  companion.row(0) = a.transpose();
  companion.bottomLeftCorner(p - 1, p - 1).setIdentity();
  return companion.eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace

MotionModel fit_motion(const Eigen::VectorXd& series, int order) {
  const Eigen::Index n = series.size();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(order, order);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(order);
  double power = 0.0;
  for (Eigen::Index k = order; k < n; ++k) {
    const Eigen::VectorXd past = series.segment(k - order, order).reverse();
    const Eigen::VectorXd future = series.segment(k - order + 1, order);
    normal += past * past.transpose() + future * future.transpose();
    right += past * series(k) + future * series(k - order);
    power += series(k) * series(k) + series(k - order) * series(k - order);
  }
  MotionModel model;
  model.sigma = std::sqrt(series.squaredNorm() / static_cast<double>(n));
  normal.diagonal().array() += 1e-13 * normal.trace();
  model.coefficients = normal.ldlt().solve(right);
  const double radius = pole_radius(model.coefficients);
  if (radius > largest_radius) {   // z -> z * radius_allowed / radius
    double factor = 1.0;
    for (Eigen::Index j = 0; j < order; ++j) {
      factor *= largest_radius / radius;
      model.coefficients(j) *= factor;
    }
  }
  const Eigen::VectorXd& a = model.coefficients;
  const double left = power - 2.0 * a.dot(right) + a.dot(normal * a);
  model.innovation_sigma = std::sqrt(std::max(left, 0.0) / (2.0 * static_cast<double>(n - order)));
  return model;
}

}  // namespace selfcal
