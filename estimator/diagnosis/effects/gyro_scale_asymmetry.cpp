// Scale factor differs between positive and negative turns.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, c.angle.cwiseAbs());
}

}  // namespace

Effect gyro_scale_asymmetry() {
  Effect e;
  e.id = "gyro_scale_asymmetry";
  e.equation = "dw_i = a_i |w_i|";
  e.excited = "rotations";
  e.experiment = "turns in both senses";
  e.parameters = axis_parameters("ppm", units::ppm, 10.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
