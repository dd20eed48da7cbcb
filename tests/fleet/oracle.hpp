// Who knows the law by which drawn_fleet.hpp ages, and who knows the truth as well: a yardstick for rules that know less.
#pragma once

#include <Eigen/Core>

#include "estimator/fleet/interval.hpp"
#include "tests/fleet/drawn_fleet.hpp"

namespace selfcal::fleet {

// One parameter of one unit by the law itself: constant, amplitude of what settles, slow and fast part.
class LawFilter {
 public:
  explicit LawFilter(const Nature& nature);
  void add(double year, double value, double noise_variance);
  void know(double year, const std::array<double, 4>& parts);  // all of it, at this instant
  Departure departure(double year, double measured) const;
  Innovation expected(double year, double value, double noise_variance) const;

 private:
  void advance(double year);
  Eigen::RowVector4d shows(double year) const;  // how much of each part is in the value

  const Nature* nature_;
  double year_ = 0.0;
  Eigen::Vector4d state_;
  Eigen::Matrix4d covariance_;
};

}  // namespace selfcal::fleet
