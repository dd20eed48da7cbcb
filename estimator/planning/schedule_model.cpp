#include "estimator/planning/schedule_model.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/geometry/units.hpp"
#include "estimator/navigation/interval_navigator.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal {
namespace {

constexpr double interval_s = 1.0;
constexpr int samples_per_interval = 50;  // 0.36 deg each at 90 deg in 5 s

// How far a move has come: rate and acceleration zero at both ends. How a move is made matters where a schedule is weak:
// Table 2 on a level base would promise sigmas a third smaller from moves at constant rate.
double minimum_jerk(double s) { return s * s * s * (10.0 - s * (15.0 - 6.0 * s)); }

// Ideal increments of a stretch of motion, for the navigator.
struct Motion {
  std::vector<double> time_s;
  std::vector<std::array<double, 3>> delta_theta, delta_v;
};

Motion ideal_motion(const std::function<Matrix3(double)>& C_nb, const SiteModel& site, double length_s) {
  Motion motion;
  const double dt = length_s / samples_per_interval;
  for (int k = 0; k < samples_per_interval; ++k) {
    const Matrix3 C0 = C_nb(k * dt);
    const Matrix3 C1 = C_nb((k + 0.5) * dt);
    const Matrix3 C2 = C_nb((k + 1) * dt);
    const Vector3 angle =
        rotation_vector_from_matrix(C0.transpose() * matrix_from_rotation_vector(site.omega_ie_n * dt) * C2);
    const Vector3 velocity = -dt / 6.0 * (C0 + 4.0 * C1 + C2).transpose() * site.gravity_n;  // Simpson
    motion.time_s.push_back((k + 1) * dt);
    motion.delta_theta.push_back({angle.x(), angle.y(), angle.z()});
    motion.delta_v.push_back({velocity.x(), velocity.y(), velocity.z()});
  }
  return motion;
}

}  // namespace

ScheduleModel::ScheduleModel(const Installation& installation)
    : installation_(installation), site_(installation.site), C_nv_(attitude_matrix(installation.attitude)) {}

UdFilter ScheduleModel::start() const {
  const PriorModel prior;
  VectorX sigma(StateLayout::navigation_count + sensor_parameter_count);
  sigma << Vector3::Constant(prior.position), Vector3::Constant(prior.velocity), Vector3::Constant(prior.attitude),
      2.0 * plausible_limit();
  UdFilter filter(VectorX::Zero(sigma.size()), sigma, sensor_parameter_count);
  const double variance = installation_.position_sigma * installation_.position_sigma / interval_s;
  for (int axis = 0; axis < 3; ++axis) {
    filter.update(VectorX::Unit(StateLayout::navigation_count, axis), 0.0, variance);
  }
  return filter;
}

const ScheduleModel::Step& ScheduleModel::step(const GimbalPosition& from, const GimbalPosition& to, double seconds,
                                               int index, int count) {
  const double length = seconds / count;
  const Key key = {from.outer_deg, from.inner_deg, to.outer_deg, to.inner_deg, length, static_cast<double>(index)};
  const auto found = steps_.find(key);
  if (found != steps_.end()) {
    return found->second;
  }
  const auto C_nb = [&](double t) -> Matrix3 {
    const double part = minimum_jerk((index * length + t) / seconds);
    const double outer = from.outer_deg + part * (to.outer_deg - from.outer_deg);
    const double inner = from.inner_deg + part * (to.inner_deg - from.inner_deg);
    return C_nv_ * gimbal_matrix(outer * units::degree, inner * units::degree);
  };
  const Motion motion = ideal_motion(C_nb, site_, length);
  ImuData data;
  data.site = installation_.site;
  data.sample_rate_hz = samples_per_interval / length;
  data.time_s = motion.time_s;
  data.delta_theta = motion.delta_theta;
  data.delta_v = motion.delta_v;
  IntervalNavigator navigator(data, ParameterVector::Zero(), C_nb(0.0), 1.0, length);
  Interval interval;
  navigator.next(interval);
  const ProcessNoise noise = process_noise(site_, installation_.gyro_arw, installation_.accel_vrw, length, 1.0);
  const double variance = installation_.position_sigma * installation_.position_sigma / length;
  return steps_.emplace(key, Step{interval.Phi, interval.Gamma, noise.L, noise.q, variance}).first->second;
}

void ScheduleModel::apply(UdFilter& filter, const Step& s) const {
  filter.propagate(s.Phi, s.Gamma, VectorX::Zero(StateLayout::navigation_count), s.L, s.q);
  for (int axis = 0; axis < 3; ++axis) {
    filter.update(VectorX::Unit(StateLayout::navigation_count, axis), 0.0, s.noise_variance);
  }
}

void ScheduleModel::dwell(UdFilter& filter, const GimbalPosition& at, double seconds) {
  if (seconds <= 0.0) {
    return;
  }
  const int count = std::max(1, static_cast<int>(std::lround(seconds / interval_s)));
  const Step& s = step(at, at, seconds / count, 0, 1);
  for (int i = 0; i < count; ++i) {
    apply(filter, s);
  }
}

void ScheduleModel::move(UdFilter& filter, const GimbalPosition& from, const GimbalPosition& to, double seconds) {
  const int count = std::max(1, static_cast<int>(std::lround(seconds / interval_s)));
  for (int i = 0; i < count; ++i) {
    apply(filter, step(from, to, seconds, i, count));
  }
}

ParameterVector ScheduleModel::sigma(const UdFilter& filter) {
  return filter.variances().tail<sensor_parameter_count>().cwiseSqrt();
}

ParameterMatrix ScheduleModel::covariance(const UdFilter& filter) {
  return filter.covariance().bottomRightCorner<sensor_parameter_count, sensor_parameter_count>();
}

}  // namespace selfcal
