// Accelerometer bias that follows the measured temperature.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(c.temperature * c.dt));
}

}  // namespace

Effect accel_temperature_measured() {
  Effect e;
  e.id = "accel_temperature";
  e.equation = "df_i = b_i (T - mean T)";
  e.excited = "whole recording";
  e.experiment = "heating the block";
  e.parameters = axis_parameters("ug/degC", units::micro_g, 5.0);
  e.needs_temperature = true;
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
