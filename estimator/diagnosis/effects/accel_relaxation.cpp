// Creep of the accelerometer after each turn.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double tau, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(decay_integral(c, tau)));
}

}  // namespace

Effect accel_relaxation() {
  Effect e;
  e.id = "accel_relaxation";
  e.equation = "df_i = r_i exp(-s/tau), s since the turn";
  e.excited = "first minutes of the dwells after a turn";
  e.experiment = "a longer dwell after fewer turns";
  e.parameters = axis_parameters("ug", units::micro_g, 50.0);
  e.constants = {10.0, 20.0, 35.0, 60.0, 100.0, 170.0};
  e.constant_name = "tau";
  e.constant_unit = "s";
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
