// The centre of the IMU does not lie on the gimbal axes.
#include "estimator/diagnosis/effects/declare.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  for (int k = 0; k < 3; ++k) {
    const Vector3 r = Vector3::Unit(k);
    velocity.col(k) += c.rate_change.cross(r) + c.angle.cross(c.rate.cross(r));
  }
}

}  // namespace

Effect imu_lever_arm() {
  Effect e;
  e.id = "imu_lever_arm";
  e.equation = "df = dw/dt x r + w x (w x r)";
  e.excited = "rotations";
  e.experiment = "a second turn rate";
  e.parameters = axis_parameters("cm", 0.01, 1.0);
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
