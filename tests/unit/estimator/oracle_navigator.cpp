#include "tests/unit/estimator/oracle_navigator.hpp"

#include <cmath>

#include "sim_ins/sensor_errors.hpp"

namespace selfcal::test {
namespace {

constexpr int steps = 400;  // 2.5 ms: 0.3 rad/s leaves (7.5e-4)^5/120 = 2e-18 rad a step

// Departures from the site are integrated, not latitude itself: rounding is then of the departure.
struct State {
  double d_latitude = 0.0, d_longitude = 0.0, d_height = 0.0;
  Vector3 v_n = Vector3::Zero();
  Eigen::Quaterniond q_nb = Eigen::Quaterniond::Identity();
};

State plus(const State& s, const State& rate, double dt) {
  State r = s;
  r.d_latitude += dt * rate.d_latitude;
  r.d_longitude += dt * rate.d_longitude;
  r.d_height += dt * rate.d_height;
  r.v_n += dt * rate.v_n;
  r.q_nb.coeffs() += dt * rate.q_nb.coeffs();
  return r;
}

// Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., ch. 3.7, for n = north up east.
State rate_of(const TurningGimbal& motion, const sim::SensorErrors& errors, const State& s, double t) {
  const earth::Position p{motion.site.latitude + s.d_latitude, 0.0, motion.site.height + s.d_height};
  const Vector3 f_true = motion.f_ib_b(t);
  const Vector3 w_true = motion.omega_ib_b(t);
  const Vector3 f_b = f_true + sim::accel_error(errors, f_true);
  const Vector3 w_b = w_true + sim::gyro_error(errors, w_true);
  const Vector3 w_ie = earth::omega_ie_n(p.latitude);
  const Vector3 w_en = earth::omega_en_n(p, s.v_n);
  State rate;
  rate.d_latitude = s.v_n.x() / (earth::meridian_radius(p.latitude) + p.height);
  rate.d_longitude = s.v_n.z() / ((earth::prime_vertical_radius(p.latitude) + p.height) * std::cos(p.latitude));
  rate.d_height = s.v_n.y();
  rate.v_n =
      s.q_nb * f_b - Vector3(0, earth::normal_gravity(p.latitude, p.height), 0) - (2.0 * w_ie + w_en).cross(s.v_n);
  const Vector3 w_nb_b = w_b - s.q_nb.conjugate() * (w_ie + w_en);
  rate.q_nb = s.q_nb * Eigen::Quaterniond(0, 0.5 * w_nb_b.x(), 0.5 * w_nb_b.y(), 0.5 * w_nb_b.z());
  return rate;
}

State navigate(const TurningGimbal& motion, const Perturbation& d, double begin, double end) {
  const double latitude = motion.site.latitude, height = motion.site.height;
  State s;
  s.d_latitude = d.position.x() / (earth::meridian_radius(latitude) + height);
  s.d_height = d.position.y();
  s.d_longitude = d.position.z() / ((earth::prime_vertical_radius(latitude) + height) * std::cos(latitude));
  s.v_n = d.velocity;
  s.q_nb = quaternion_from_rotation_vector(-d.attitude) * Eigen::Quaterniond(motion.C_nb(begin));
  const double dt = (end - begin) / steps;
  for (int i = 0; i < steps; ++i) {
    const double t = begin + i * dt;
    const State k1 = rate_of(motion, d.errors, s, t);
    const State k2 = rate_of(motion, d.errors, plus(s, k1, 0.5 * dt), t + 0.5 * dt);
    const State k3 = rate_of(motion, d.errors, plus(s, k2, 0.5 * dt), t + 0.5 * dt);
    const State k4 = rate_of(motion, d.errors, plus(s, k3, dt), t + dt);
    s = plus(plus(plus(plus(s, k1, dt / 6.0), k2, dt / 3.0), k3, dt / 3.0), k4, dt / 6.0);
    s.q_nb.normalize();
  }
  return s;
}

}  // namespace

Matrix3 TurningGimbal::C_nb(double t) const {
  return attitude_matrix(vehicle) * gimbal_matrix(outer_start + outer_rate * t, inner);
}

Vector3 TurningGimbal::omega_ib_b(double t) const {
  return rotation_y(inner).transpose() * Vector3(0, 0, outer_rate) +
         C_nb(t).transpose() * earth::omega_ie_n(site.latitude);
}

Vector3 TurningGimbal::f_ib_b(double t) const {
  return C_nb(t).transpose() * Vector3(0, earth::normal_gravity(site.latitude, site.height), 0);
}

Eigen::Matrix<double, 9, 1> navigation_error(const TurningGimbal& motion, const Perturbation& perturbation,
                                             double begin, double end) {
  const State computed = navigate(motion, perturbation, begin, end);
  const State truth = navigate(motion, {}, begin, end);
  const double latitude = motion.site.latitude, height = motion.site.height;
  Eigen::Matrix<double, 9, 1> error;
  error << (computed.d_latitude - truth.d_latitude) * (earth::meridian_radius(latitude) + height),
      computed.d_height - truth.d_height,
      (computed.d_longitude - truth.d_longitude) * (earth::prime_vertical_radius(latitude) + height) *
          std::cos(latitude),
      computed.v_n - truth.v_n,
      -rotation_vector_from_matrix((computed.q_nb * truth.q_nb.conjugate()).toRotationMatrix());
  return error;
}

}  // namespace selfcal::test
