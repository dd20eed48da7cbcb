// Accelerometer scale that drifts as the block warms up; temperature not measured. A time constant far beyond the recording stands for a linear drift.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double tau, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.force * warm_up_integral(c, tau));
}

}  // namespace

Effect accel_scale_temperature() {
  Effect e;
  e.id = "accel_scale_temperature";
  e.equation = "df_i = k_i (1 - exp(-t/tau)) f_i";
  e.excited = "dwells, by axis along gravity";
  e.experiment = "a temperature channel";
  e.parameters = axis_parameters("ppm", units::ppm, 10.0);
  e.constants = {120.0, 480.0, 1920.0, 30000.0};
  e.constant_name = "tau";
  e.constant_unit = "s";
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
