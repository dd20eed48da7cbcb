// Gyro drift that warms up with an unknown time constant; temperature not measured.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double tau, Columns /*velocity*/, Columns angle) {
  add_axes(angle, Vector3::Constant(warm_up_integral(c, tau)));
}

}  // namespace

Effect gyro_temperature() {
  Effect e;
  e.id = "gyro_temperature";
  e.equation = "dw_i = b_i (1 - exp(-t/tau))";
  e.excited = "whole recording, mostly its start";
  e.experiment = "a temperature channel";
  e.parameters = axis_parameters("deg/h", units::degree_per_hour, 0.01);
  e.constants = {60.0, 120.0, 240.0, 480.0, 960.0, 1920.0};
  e.constant_name = "tau";
  e.constant_unit = "s";
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
