#include "tests/fleet/oracle.hpp"

#include <cmath>

namespace selfcal::fleet {

LawFilter::LawFilter(const Nature& nature) : nature_(&nature), state_(0.0, nature.settling, 0.0, 0.0) {
  const Eigen::Vector4d sd(nature.between_units, nature.settling_spread, nature.slow, nature.fast);
  covariance_ = sd.cwiseAbs2().asDiagonal();
}

Eigen::RowVector4d LawFilter::shows(double year) const {
  return {1.0, 1.0 - std::exp(-year / nature_->settling_years), 1.0, 1.0};
}

void LawFilter::advance(double year) {
  const double dt = year - year_;
  year_ = year;
  const Eigen::Vector4d kept(1.0, 1.0, std::exp(-dt / nature_->slow_years), std::exp(-dt / nature_->fast_years));
  const Eigen::Vector4d sd(0.0, 0.0, nature_->slow, nature_->fast);
  state_ = kept.cwiseProduct(state_);
  covariance_ = kept.asDiagonal() * covariance_ * kept.asDiagonal();
  covariance_.diagonal() += sd.cwiseAbs2().cwiseProduct((1.0 - kept.array().square()).matrix());
}

Innovation LawFilter::expected(double year, double value, double noise_variance) const {
  LawFilter then = *this;
  then.advance(year);
  const Eigen::RowVector4d h = then.shows(year);
  return {value - h * then.state_, h * then.covariance_ * h.transpose() + noise_variance};
}

void LawFilter::add(double year, double value, double noise_variance) {
  const Innovation innovation = expected(year, value, noise_variance);
  advance(year);
  const Eigen::Vector4d with_value = covariance_ * shows(year).transpose();
  state_ += with_value * (innovation.value / innovation.variance);
  covariance_ -= with_value * with_value.transpose() / innovation.variance;
}

void LawFilter::know(double year, const std::array<double, 4>& parts) {
  year_ = year;
  state_ = Eigen::Map<const Eigen::Vector4d>(parts.data());
  covariance_.setZero();
}

Departure LawFilter::departure(double year, double measured) const {
  LawFilter then = *this;
  then.advance(year);
  const double settled = std::exp(-year / nature_->settling_years) / nature_->settling_years;
  const double slow = 1.0 / nature_->slow_years, fast = 1.0 / nature_->fast_years;
  const Eigen::RowVector4d h = then.shows(year), slope(0.0, settled, -slow, -fast);
  const double comes_in = 2.0 * (slow * nature_->slow * nature_->slow + fast * nature_->fast * nature_->fast);
  return {h * then.state_ - measured, slope * then.state_, h * then.covariance_ * h.transpose(),
          slope * then.covariance_ * h.transpose() + comes_in};
}

}  // namespace selfcal::fleet
