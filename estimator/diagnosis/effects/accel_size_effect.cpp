// Each accelerometer sits at its own place r_i.
#include "estimator/diagnosis/effects/declare.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  for (int k = 0; k < 3; ++k) {
    const Vector3 r = Vector3::Unit(k);
    const Vector3 gain = c.rate_change.cross(r) + c.angle.cross(c.rate.cross(r));
    for (int axis = 0; axis < 3; ++axis) {
      velocity(axis, 3 * axis + k) += gain(axis);
    }
  }
}

}  // namespace

Effect accel_size_effect() {
  Effect e;
  e.id = "accel_size_effect";
  e.equation = "df_i = [dw/dt x r_i + w x (w x r_i)]_i";
  e.excited = "rotations";
  e.experiment = "a second turn rate";
  e.parameters = matrix_parameters("cm", 0.01, 1.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
