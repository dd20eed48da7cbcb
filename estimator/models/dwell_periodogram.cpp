#include "estimator/models/dwell_periodogram.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

namespace selfcal {
namespace {

constexpr int detrend_order = 8;  // a sway of 5 s is two thirds of a cycle of a piece of 3.2 s

}  // namespace

DwellPeriodogram::DwellPeriodogram(Eigen::Index length) : rows_(2 * bin_count, length) {
  Eigen::MatrixXd basis(length, detrend_order + 1);
  Eigen::VectorXd taper(length);
  for (Eigen::Index i = 0; i < length; ++i) {
    const double at = (static_cast<double>(i) + 0.5) / static_cast<double>(length);
    const double sine = std::sin(std::numbers::pi * at);
    taper(i) = sine * sine * sine * sine;
    for (int k = 0; k <= detrend_order; ++k) {
      basis(i, k) = std::legendre(static_cast<unsigned>(k), 2.0 * at - 1.0);
    }
    for (int b = 0; b < bin_count; ++b) {
      const double phase = 2.0 * std::numbers::pi * (b + lowest_bin) * at;
      rows_(b, i) = std::cos(phase);
      rows_(bin_count + b, i) = std::sin(phase);
    }
  }
  // x = W (r - B a), a of least squares in the window's own weights: what remains is orthogonal under the window.
  const Eigen::MatrixXd tapered = taper.asDiagonal() * basis;
  const Eigen::MatrixXd along = (tapered.transpose() * tapered).ldlt().solve((rows_ * tapered).transpose());
  rows_ = (rows_ - along.transpose() * tapered.transpose()) * taper.asDiagonal();
  white_gain_ = rows_.topRows(bin_count).rowwise().squaredNorm() + rows_.bottomRows(bin_count).rowwise().squaredNorm();
}

DwellPeriodogram::Bins DwellPeriodogram::density(const Eigen::VectorXd& rates, double interval_s) const {
  const Eigen::ArrayXd along = (rows_ * rates).array();
  return (along.head(bin_count).square() + along.tail(bin_count).square()) * interval_s / white_gain_;
}

// Variance of each row's product with the differences of white noise of unit variance: neighbours correlate by -1.
DwellPeriodogram::Bins DwellPeriodogram::angle_density(double interval_s) const {
  const Eigen::Index length = rows_.cols();
  const Eigen::ArrayXd power =
      2.0 * rows_.rowwise().squaredNorm() -
      2.0 * rows_.leftCols(length - 1).cwiseProduct(rows_.rightCols(length - 1)).rowwise().sum();
  return (power.head(bin_count) + power.tail(bin_count)) / white_gain_ / interval_s;
}

}  // namespace selfcal
