// Gyro drift that follows the measured temperature.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, Vector3::Constant(c.temperature * c.dt));
}

}  // namespace

Effect gyro_temperature_measured() {
  Effect e;
  e.id = "gyro_temperature";
  e.equation = "dw_i = b_i (T - mean T)";
  e.excited = "whole recording";
  e.experiment = "heating the block";
  e.parameters = axis_parameters("deg/h/degC", units::degree_per_hour, 0.001);
  e.needs_temperature = true;
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
