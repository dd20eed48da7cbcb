// Nonlinearity in the input axis, second order. In dwells with |u| 0 or 1 the scale factors absorb it.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.u.cwiseAbs2() * c.dt);
}

}  // namespace

Effect accel_quadratic() {
  Effect e;
  e.id = "accel_quadratic";
  e.equation = "df_i = k_i u_i^2";
  e.excited = "rotations";
  e.experiment = "dwells at 45 deg";
  e.parameters = axis_parameters("ug/g^2", units::micro_g, 20.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
