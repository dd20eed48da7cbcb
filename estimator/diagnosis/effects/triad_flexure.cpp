// The accelerometer triad bends against the gyro triad under gravity.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      velocity.col(3 * row + k) += c.u(k) * Vector3::Unit(row).cross(c.velocity);
    }
  }
}

}  // namespace

Effect triad_flexure() {
  Effect e;
  e.id = "triad_flexure";
  e.equation = "df = (K u) x f";
  e.excited = "dwells and rotations";
  e.experiment = "dwells at 45 deg, a tilted base";
  e.parameters = matrix_parameters("arcsec/g", units::arcsecond, 2.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
