// Accelerometer scale that follows the measured temperature.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.temperature * c.velocity);
}

}  // namespace

Effect accel_scale_temperature_measured() {
  Effect e;
  e.id = "accel_scale_temperature";
  e.equation = "df_i = k_i (T - mean T) f_i";
  e.excited = "dwells, by axis along gravity";
  e.experiment = "heating the block";
  e.parameters = axis_parameters("ppm/degC", units::ppm, 2.0);
  e.needs_temperature = true;
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
