// Gyro drift proportional to specific force.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_matrix(angle, c.u * c.dt);
}

}  // namespace

Effect gyro_g_sensitivity() {
  Effect e;
  e.id = "gyro_g_sensitivity";
  e.equation = "dw_i = sum_j G_ij u_j";
  e.excited = "dwells";
  e.experiment = "a tilted base, a second heading";
  e.parameters = matrix_parameters("deg/h/g", units::degree_per_hour, 0.01);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
