#include "estimator/diagnosis/ideal_recording.hpp"

#include <cmath>
#include <numbers>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

struct Profile {
  const Schedule* schedule;
  double ramp;  // share of a move's time, 0.5 at most

  // Share of the way at the share x of the time. A ramp covers half of the way that the steady rate covers in its time.
  double done(double x) const {
    const auto rising = [this](double s) {
      return ramp > 0.0 ? 0.5 * (s - ramp / std::numbers::pi * std::sin(std::numbers::pi * s / ramp)) : 0.0;
    };
    const double steady = 1.0 / (1.0 - ramp);
    if (x < ramp) {
      return steady * rising(x);
    }
    return x > 1.0 - ramp ? 1.0 - steady * rising(1.0 - x) : steady * (x - 0.5 * ramp);
  }

  GimbalPosition at(double t) const {
    const Schedule& s = *schedule;
    for (std::size_t k = 0; k < s.positions.size(); ++k) {
      if (t <= s.dwell_s[k] || k + 1 == s.positions.size()) {
        return s.positions[k];
      }
      t -= s.dwell_s[k];
      if (t < s.rotation_s) {
        const double way = done(t / s.rotation_s);
        const GimbalPosition& a = s.positions[k];
        const GimbalPosition& b = s.positions[k + 1];
        return {a.outer_deg + way * (b.outer_deg - a.outer_deg), a.inner_deg + way * (b.inner_deg - a.inner_deg)};
      }
      t -= s.rotation_s;
    }
    return {};
  }
};

}  // namespace

IdealRecording::IdealRecording(const Schedule& schedule, const Attitude& vehicle, const earth::Position& site,
                               double rate_hz, double ramp) {
  const Profile profile{&schedule, ramp};
  const Matrix3 C_nv = attitude_matrix(vehicle);
  const Vector3 omega_ie_n = earth::omega_ie_n(site.latitude);
  const Vector3 f_n(0.0, earth::normal_gravity(site.latitude, site.height), 0.0);
  const auto attitude = [&](double t) -> Matrix3 {
    const GimbalPosition p = profile.at(t);
    return C_nv * gimbal_matrix(p.outer_deg * units::degree, p.inner_deg * units::degree);
  };
  const double dt = 1.0 / rate_hz;
  const Matrix3 turn_of_n = matrix_from_rotation_vector(omega_ie_n * dt);  // C from n at the end to n at the start
  Matrix3 C_nb = attitude(0.0);
  C_nb_start_ = C_nb;
  const auto count = static_cast<std::size_t>(schedule.duration_s() * rate_hz);
  for (std::size_t k = 1; k <= count; ++k) {
    const double t = static_cast<double>(k) * dt;
    const Matrix3 next = attitude(t);
    const Vector3 angle = rotation_vector_from_matrix(C_nb.transpose() * turn_of_n * next);
    const Vector3 velocity = attitude(t - 0.5 * dt).transpose() * f_n * dt;
    const GimbalPosition p = profile.at(t);
    time_s_.push_back(t);
    outer_.push_back(p.outer_deg * units::degree);
    inner_.push_back(p.inner_deg * units::degree);
    delta_theta_.push_back({angle.x(), angle.y(), angle.z()});
    delta_v_.push_back({velocity.x(), velocity.y(), velocity.z()});
    C_nb = next;
  }
  data_.site = site;
  data_.sample_rate_hz = rate_hz;
  data_.time_s = time_s_;
  data_.delta_theta = delta_theta_;
  data_.delta_v = delta_v_;
  data_.gimbal_outer = outer_;
  data_.gimbal_inner = inner_;
}

}  // namespace selfcal::diagnosis
