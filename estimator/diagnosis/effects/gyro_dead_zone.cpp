// Lock-in at low rate: the output lags by a little, in the sense of the rate.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double rate_constant, Columns /*velocity*/, Columns angle) {
  add_axes(angle, -c.dt * (c.rate / rate_constant).array().tanh().matrix());
}

}  // namespace

Effect gyro_dead_zone() {
  Effect e;
  e.id = "gyro_dead_zone";
  e.equation = "dw_i = -a_i tanh(w_i/w0)";
  e.excited = "dwells, by the sign of the Earth rate on the axis";
  e.experiment = "a second heading";
  e.parameters = axis_parameters("deg/h", units::degree_per_hour, 0.01);
  e.constants = {0.2 * units::degree_per_hour, 5.0 * units::degree_per_hour, 20.0 * units::degree_per_hour};
  e.constant_name = "w0";
  e.constant_unit = "rad/s";
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
