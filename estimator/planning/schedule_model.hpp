// The calibration filter without data: its covariance through dwells and moves of the gimbal.
#pragma once

#include <array>
#include <map>
#include <memory>

#include "estimator/filter/ud_filter.hpp"
#include "estimator/navigation/error_dynamics.hpp"
#include "estimator/planning/plan.hpp"

namespace selfcal {

// Interval models (Phi, Gamma) of each dwell and move. The vehicle stands on the Earth, so they do not depend on when
// a move takes place; each is computed once.
class ScheduleModel {
 public:
  explicit ScheduleModel(const Installation& installation);

  UdFilter start() const;  // the prior, and the first observation
  void dwell(UdFilter& filter, const GimbalPosition& at, double seconds);
  void move(UdFilter& filter, const GimbalPosition& from, const GimbalPosition& to, double seconds);

  static ParameterVector sigma(const UdFilter& filter);
  static ParameterMatrix covariance(const UdFilter& filter);

 private:
  struct Step {
    MatrixX Phi, Gamma, L;
    VectorX q;
    double noise_variance;
  };
  using Key = std::array<double, 6>;  // from (outer, inner), to (outer, inner), interval length, index
  const Step& step(const GimbalPosition& from, const GimbalPosition& to, double seconds, int index, int count);
  void apply(UdFilter& filter, const Step& s) const;

  Installation installation_;
  SiteModel site_;
  Matrix3 C_nv_;
  std::map<Key, Step> steps_;
};

}  // namespace selfcal
