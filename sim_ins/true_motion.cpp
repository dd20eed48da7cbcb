#include "sim_ins/true_motion.hpp"

#include <cmath>

namespace selfcal::sim {
namespace {

// omega_nv_v: C_nv = Ry(-psi) Rz(theta) Rx(gamma), each turn's rate carried through those after it.
Vector3 omega_nv_v(const BaseState& base) {
  const Vector3 heading_rate(0.0, -base.attitude_rate.heading, 0.0);
  const Vector3 before_roll =
      rotation_z(base.attitude.pitch).transpose() * heading_rate + Vector3(0.0, 0.0, base.attitude_rate.pitch);
  return rotation_x(base.attitude.roll).transpose() * before_roll + Vector3(base.attitude_rate.roll, 0.0, 0.0);
}

// omega_vb_b: C_vb = Rz(outer) Ry(inner).
Vector3 omega_vb_b(const GimbalState& gimbal) {
  return {-std::sin(gimbal.angle[1]) * gimbal.rate[0], gimbal.rate[1], std::cos(gimbal.angle[1]) * gimbal.rate[0]};
}

}  // namespace

TrueMotion::TrueMotion(const earth::Position& site, const Attitude& mean, BaseMotion base, GimbalMotion gimbal)
    : site_(site), mean_(mean), base_(std::move(base)), gimbal_(std::move(gimbal)), base_still_(base_.still()) {}

MotionState TrueMotion::at(double t) const {
  const BaseState base = base_state(base_, mean_, t);
  const GimbalState gimbal = gimbal_.at(t);
  // Here and now: the displacement is metres, so a radius of curvature taken at the site is exact to 1e-6 of it.
  earth::Position here = site_;
  here.latitude += base.p_n.x() / (earth::meridian_radius(site_.latitude) + site_.height);
  here.height += base.p_n.y();

  const Matrix3 C_nv = attitude_matrix(base.attitude);
  const Matrix3 C_vb = gimbal_matrix(gimbal.angle[0], gimbal.angle[1]);
  MotionState state;
  state.C_nb = C_nv * C_vb;
  const Vector3 omega_ie = earth::omega_ie_n(here.latitude);
  const Vector3 omega_en = earth::omega_en_n(here, base.v_n);
  state.omega_ib_b =
      state.C_nb.transpose() * (omega_ie + omega_en) + C_vb.transpose() * omega_nv_v(base) + omega_vb_b(gimbal);
  // dv/dt = f - (2 omega_ie + omega_en) x v + g, solved for f.
  const Vector3 gravity_n(0.0, -earth::normal_gravity(here.latitude, here.height), 0.0);
  const Vector3 f_n = base.a_n + (2.0 * omega_ie + omega_en).cross(base.v_n) - gravity_n;
  state.f_ib_b = state.C_nb.transpose() * f_n;
  return state;
}

Vector3 TrueMotion::omega_ib_b(double t) const { return at(t).omega_ib_b; }

Vector3 TrueMotion::angular_acceleration(double t) const {
  constexpr double step = 1e-4;
  return (omega_ib_b(t + step) - omega_ib_b(t - step)) / (2.0 * step);
}

}  // namespace selfcal::sim
