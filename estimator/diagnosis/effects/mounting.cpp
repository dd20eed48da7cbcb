// Where the sensors sit, how they stand to each other, and when they are sampled.
#include "estimator/diagnosis/effects/families.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Velocity of a point at r over a stretch, less that of the centre: dw/dt x r + w x (w x r).
Vector3 velocity_at(const EffectContext& c, const Vector3& r) {
  return c.rate_change.cross(r) + c.angle.cross(c.rate.cross(r));
}

// The centre of the IMU does not lie on the gimbal axes.
void lever_arm(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  for (int k = 0; k < 3; ++k) {
    velocity.col(k) += velocity_at(c, Vector3::Unit(k));
  }
}

// Each accelerometer sits at its own place r_i.
void size_effect(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  for (int k = 0; k < 3; ++k) {
    const Vector3 gained = velocity_at(c, Vector3::Unit(k));
    for (int axis = 0; axis < 3; ++axis) {
      velocity(axis, 3 * axis + k) += gained(axis);
    }
  }
}

// The accelerometers are sampled later than the gyros by tau.
void time_offset(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  velocity.col(0) += c.angle.cross(c.force);
}

// The accelerometer triad bends against the gyro triad under gravity.
void flexure(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      velocity.col(3 * row + k) += c.u(k) * Vector3::Unit(row).cross(c.velocity);
    }
  }
}

}  // namespace

std::vector<Effect> mounting_effects() {
  std::vector<Effect> all;
  all.push_back({.id = "imu_lever_arm",
                 .words = "IMU centre that is off the gimbal's centre (lever arm)",
                 .place = 10,
                 .equation = "df = dw/dt x r + w x (w x r)",
                 .excited = "rotations",
                 .experiment = "a second turn rate",
                 .parameters = axis_parameters("cm", 0.01, 1.0),
                 .sensor = lever_arm});
  all.push_back({.id = "accel_gyro_time_offset",
                 .words = "accelerometers sampled at another time than the gyros",
                 .place = 20,
                 .equation = "df = f(t - tau) - f(t) = tau w x f",
                 .excited = "rotations",
                 .experiment = "a second turn rate",
                 .parameters = {{"tau", "ms", 1e-3, 0.3}},
                 .sensor = time_offset});
  all.push_back({.id = "accel_size_effect",
                 .words = "accelerometers that do not sit at one point (size effect)",
                 .place = 210,
                 .equation = "df_i = [dw/dt x r_i + w x (w x r_i)]_i",
                 .excited = "rotations",
                 .experiment = "a second turn rate",
                 .parameters = matrix_parameters("cm", 0.01, 1.0),
                 .sensor = size_effect});
  all.push_back({.id = "triad_flexure",
                 .words = "accelerometer triad that bends under gravity",
                 .place = 220,
                 .equation = "df = (K u) x f",
                 .excited = "dwells and rotations",
                 .experiment = "dwells at 45 deg, a tilted base",
                 .parameters = matrix_parameters("arcsec/g", units::arcsecond, 2.0),
                 .sensor = flexure});
  return all;
}

}  // namespace selfcal::diagnosis
