// Gyro drift proportional to the magnetic field in b.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_matrix(angle, c.field_b * c.dt);
}

}  // namespace

Effect gyro_magnetic_sensitivity() {
  Effect e;
  e.id = "gyro_magnetic_sensitivity";
  e.equation = "dw_i = sum_j M_ij B_j";
  e.excited = "dwells";
  e.experiment = "a second heading, a coil";
  e.parameters = matrix_parameters("deg/h/G", units::degree_per_hour, 0.02);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
