// The true motion of the IMU: attitude, angular rate and specific force in b, from base, gimbal and Earth.
#pragma once

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/rotation.hpp"
#include "sim_ins/base_motion.hpp"
#include "sim_ins/gimbal.hpp"

namespace selfcal::sim {

// At one instant; the IMU sits in the gimbal's centre, which is at the stated position plus the base's displacement.
struct MotionState {
  Matrix3 C_nb = Matrix3::Identity();
  Vector3 omega_ib_b = Vector3::Zero();  // rad/s
  Vector3 f_ib_b = Vector3::Zero();      // m/s^2
};

class TrueMotion {
 public:
  TrueMotion(const earth::Position& site, const Attitude& mean, BaseMotion base, GimbalMotion gimbal);

  // Validity: displacements of metres (the position is linear in them) and any attitude rate.
  MotionState at(double t) const;
  // d(omega_ib_b)/dt by central difference over 0.2 ms: with rates below 1 rad/s and motion slower than 0.1 s the
  // error is below 1e-9 rad/s^2 plus 1e-12 of rounding.
  Vector3 angular_acceleration(double t) const;

  const GimbalMotion& gimbal() const { return gimbal_; }
  bool base_still() const { return base_still_; }

 private:
  Vector3 omega_ib_b(double t) const;

  earth::Position site_;
  Attitude mean_;
  BaseMotion base_;
  GimbalMotion gimbal_;
  bool base_still_;
};

}  // namespace selfcal::sim
