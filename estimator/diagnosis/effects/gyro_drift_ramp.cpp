// Gyro drift linear in time.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, Vector3::Constant(0.5 * (c.start_s + c.end_s) * c.dt));
}

}  // namespace

Effect gyro_drift_ramp() {
  Effect e;
  e.id = "gyro_drift_ramp";
  e.equation = "dw_i = c_i t";
  e.excited = "whole recording";
  e.experiment = "a longer recording";
  e.parameters = axis_parameters("deg/h/h", units::degree_per_hour / units::hour, 0.01);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
