// Scale factor depends on the rate.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, c.angle.cwiseProduct(c.rate.cwiseAbs()));
}

}  // namespace

Effect gyro_scale_nonlinearity() {
  Effect e;
  e.id = "gyro_scale_nonlinearity";
  e.equation = "dw_i = c_i w_i |w_i|";
  e.excited = "rotations, by the change of rate within them";
  e.experiment = "a second turn rate";
  e.parameters = axis_parameters("ppm/(deg/s)", units::ppm / units::degree, 1.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
