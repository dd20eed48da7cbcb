// Nonlinearity in the input axis, third order.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.u.cwiseAbs2().cwiseProduct(c.u) * c.dt);
}

}  // namespace

Effect accel_cubic() {
  Effect e;
  e.id = "accel_cubic";
  e.equation = "df_i = k_i u_i^3";
  e.excited = "rotations";
  e.experiment = "dwells at 45 deg";
  e.parameters = axis_parameters("ug/g^3", units::micro_g, 10.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
