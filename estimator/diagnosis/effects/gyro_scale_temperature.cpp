// Gyro scale that drifts as the block warms up; temperature not measured. A time constant far beyond the recording stands for a linear drift.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double tau, Columns /*velocity*/, Columns angle) {
  add_axes(angle, c.rate * warm_up_integral(c, tau));
}

}  // namespace

Effect gyro_scale_temperature() {
  Effect e;
  e.id = "gyro_scale_temperature";
  e.equation = "dw_i = k_i (1 - exp(-t/tau)) w_i";
  e.excited = "rotations, early against late";
  e.experiment = "a temperature channel";
  e.parameters = axis_parameters("ppm", units::ppm, 10.0);
  e.constants = {120.0, 480.0, 1920.0, 30000.0};
  e.constant_name = "tau";
  e.constant_unit = "s";
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
