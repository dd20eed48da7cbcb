// The accelerometers are sampled later than the gyros by tau.
#include "estimator/diagnosis/effects/declare.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  velocity.col(0) += c.angle.cross(c.force);
}

}  // namespace

Effect accel_gyro_time_offset() {
  Effect e;
  e.id = "accel_gyro_time_offset";
  e.equation = "df = f(t - tau) - f(t) = tau w x f";
  e.excited = "rotations";
  e.experiment = "a second turn rate";
  e.parameters = {{"tau", "ms", 1e-3, 0.3}};
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
