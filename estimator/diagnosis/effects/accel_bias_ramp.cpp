// Accelerometer bias linear in time.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(0.5 * (c.start_s + c.end_s) * c.dt));
}

}  // namespace

Effect accel_bias_ramp() {
  Effect e;
  e.id = "accel_bias_ramp";
  e.equation = "df_i = c_i t";
  e.excited = "whole recording";
  e.experiment = "a longer recording, a temperature channel";
  e.parameters = axis_parameters("ug/h", units::micro_g / units::hour, 20.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
