// Recordings for the benchmarks: ideal increments of the horizontal schedule, any length and rate.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/models/imu_data.hpp"

namespace selfcal::bench {

struct Samples {
  std::vector<double> time_s, outer, inner;
  std::vector<std::array<double, 3>> delta_theta, delta_v;
  double rate_hz = 0.0;

  ImuData view() const {
    ImuData data;
    data.site = site();
    data.sample_rate_hz = rate_hz;
    data.time_s = time_s;
    data.delta_theta = delta_theta;
    data.delta_v = delta_v;
    data.gimbal_outer = outer;
    data.gimbal_inner = inner;
    return data;
  }
  // Of all samples, as the estimator is given them.
  double bytes() const {
    return static_cast<double>(time_s.size()) * (3.0 * sizeof(double) + 2.0 * sizeof(delta_v[0]));
  }

  static earth::Position site() { return {40.0 * units::degree, 116.0 * units::degree, 50.0}; }
};

// Dwells as long as it takes to fill `duration_s`, moves of 5 s. Error-free sensors: time and memory do not depend on
// the values, only on what turns.
inline Samples ideal_samples(double duration_s, double rate_hz) {
  constexpr double move_s = 5.0;
  const Schedule shape = *named_schedule("horizontal");
  const auto positions = shape.positions.size();
  const double dwell_s = (duration_s - move_s * static_cast<double>(positions - 1)) / static_cast<double>(positions);
  const Schedule schedule = *named_schedule("horizontal", dwell_s, move_s);
  const auto count = static_cast<std::size_t>(std::llround(duration_s * rate_hz));
  const double dt = 1.0 / rate_hz;
  const Vector3 omega_n = earth::omega_ie_n(Samples::site().latitude);
  const Vector3 up_n(0.0, earth::normal_gravity(Samples::site().latitude, Samples::site().height), 0.0);

  Samples s;
  s.rate_hz = rate_hz;
  s.time_s.reserve(count);
  s.outer.reserve(count);
  s.inner.reserve(count);
  s.delta_theta.reserve(count);
  s.delta_v.reserve(count);
  Matrix3 C = Matrix3::Identity();  // of b at the sample's start; the vehicle stands level and north
  for (std::size_t k = 0; k < count; ++k) {
    const double end = static_cast<double>(k + 1) * dt;
    const auto at = std::min(positions - 1, static_cast<std::size_t>(end / (dwell_s + move_s)));
    const double moved = (end - static_cast<double>(at) * (dwell_s + move_s) - dwell_s) / move_s;
    const GimbalPosition& from = schedule.positions[at];
    const GimbalPosition& to = schedule.positions[std::min(at + 1, positions - 1)];
    const double part = std::clamp(moved, 0.0, 1.0);
    const double outer = (from.outer_deg + part * (to.outer_deg - from.outer_deg)) * units::degree;
    const double inner = (from.inner_deg + part * (to.inner_deg - from.inner_deg)) * units::degree;
    const Matrix3 C_end = part > 0.0 || moved <= dt / move_s ? gimbal_matrix(outer, inner) : C;
    const Vector3 angle = rotation_vector_from_matrix(C.transpose() * C_end) + dt * C.transpose() * omega_n;
    const Vector3 velocity = dt * 0.5 * (C + C_end).transpose() * up_n;
    C = C_end;
    s.time_s.push_back(end);
    s.outer.push_back(outer);
    s.inner.push_back(inner);
    s.delta_theta.push_back({angle.x(), angle.y(), angle.z()});
    s.delta_v.push_back({velocity.x(), velocity.y(), velocity.z()});
  }
  return s;
}

}  // namespace selfcal::bench
