// Periodogram of a piece of a dwell, 6 to 26 cycles of it, that slow motion of whatever size does not leak into.
#pragma once

#include <Eigen/Core>

namespace selfcal {

// Takes a polynomial out of the piece and tapers it (sin^4); sway is slow and large, and must not leak into the band. What
// both do to noise is linear and taken into account: at the lowest bins the polynomial takes some of it away.
class DwellPeriodogram {
 public:
  static constexpr int lowest_bin = 6, highest_bin = 26;  // cycles of a piece
  static constexpr int bin_count = highest_bin - lowest_bin + 1;
  using Bins = Eigen::Array<double, bin_count, 1>;

  explicit DwellPeriodogram(Eigen::Index length);  // values of a piece

  // Of rates (per s), one each interval_s, as many as the piece is long: density per Hz, two-sided; white noise of asd N
  // gives N^2.
  Bins density(const Eigen::VectorXd& rates, double interval_s) const;
  // The same of white angle of unit variance: about 4 sin^2(pi f D)/D.
  Bins angle_density(double interval_s) const;

 private:
  Eigen::MatrixXd rows_;  // [2 bin_count x length]: cosines, then sines
  Bins white_gain_;
};

}  // namespace selfcal
