#include "estimator/navigation/interval_navigator.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal {
namespace {

// Attitude is taken as that of the block's middle: the error of a sensitivity is (turn/2)^2/6 of it, 4e-7 here.
constexpr double block_turn = 3e-3;  // rad

}  // namespace

// Sums over one interval. tau: time since the navigation entered it (positive in both directions).
struct IntervalNavigator::Moments {
  double tau = 0.0;
  Vector3 velocity = Vector3::Zero();       // int C f
  Vector3 velocity_tau = Vector3::Zero();   // int tau C f
  Vector3 velocity_rest = Vector3::Zero();  // int (length - tau) C f
  AccelSensitivity A0 = AccelSensitivity::Zero(), A1 = AccelSensitivity::Zero();
  GyroSensitivity W0 = GyroSensitivity::Zero(), W1 = GyroSensitivity::Zero(), W2 = GyroSensitivity::Zero();
  Eigen::Matrix3Xd XA0, XA1, XW0, XW1, XW2;  // the same for extra signatures
  Eigen::Matrix3Xd extra_velocity, extra_angle;

  SensorBlock block;
  Matrix3 C_block;  // where the block was entered
  double tau_block = 0.0;
  bool open = false;
  Matrix3 C_now;
};

IntervalNavigator::IntervalNavigator(const ImuData& data, const ParameterVector& parameters, const Matrix3& C_nb,
                                     double sign, double interval_s, ExtraSignatures* extra, ForceSource force)
    : data_(data),
      compensation_(parameters),
      site_(data.site),
      q_nb_(C_nb),
      sign_(sign),
      samples_per_interval_(static_cast<std::size_t>(std::max(1.0, std::round(interval_s * data.sample_rate_hz)))),
      extra_(extra),
      force_(force) {}

double IntervalNavigator::sample_dt(std::size_t index) const {
  return index == 0 ? 1.0 / data_.sample_rate_hz : data_.time_s[index] - data_.time_s[index - 1];
}

// Makes angle_, velocity_ those of sample `index` and previous_* those of the sample before it in time.
void IntervalNavigator::load(std::size_t index) {
  const auto compensated = [this](std::size_t i, Vector3& angle, Vector3& velocity) {
    const double dt = sample_dt(i);
    angle = compensation_.angle(Eigen::Map<const Vector3>(data_.delta_theta[i].data()), dt);
    velocity = compensation_.velocity(Eigen::Map<const Vector3>(data_.delta_v[i].data()), dt);
  };
  if (sign_ > 0.0) {
    previous_angle_ = angle_;
    previous_velocity_ = velocity_;
    compensated(index, angle_, velocity_);
  } else {
    if (loaded_ == index + 1) {
      angle_ = previous_angle_;
      velocity_ = previous_velocity_;
    } else {
      compensated(index, angle_, velocity_);
    }
    previous_angle_.setZero();
    previous_velocity_.setZero();
    if (index > 0) {
      compensated(index - 1, previous_angle_, previous_velocity_);
    }
  }
  loaded_ = index;
}

const Coast* IntervalNavigator::coast_at(std::size_t index) const {
  const auto after = std::upper_bound(data_.coasts.begin(), data_.coasts.end(), index,
                                      [](std::size_t i, const Coast& c) { return i < c.last; });
  return after != data_.coasts.end() && after->first <= index ? &*after : nullptr;
}

// A sample without gyros: C_nb as it was, or turned once. What (N5) will take out of it is put in here.
void IntervalNavigator::coast(const Coast& coast, std::size_t index, double length, Moments& m, Interval& interval) {
  close_block(m, length);
  const double dt = sample_dt(index);
  if (coast.turned && index == (sign_ > 0.0 ? coast.first : coast.last - 1)) {
    q_nb_ = q_nb_ * Eigen::Quaterniond(sign_ > 0.0 ? coast.turn : Matrix3(coast.turn.transpose()));
    interval.turned = static_cast<int>(&coast - data_.coasts.data());
  }
  q_nb_ = quaternion_from_rotation_vector(sign_ * dt * site_.omega_ie_n) * q_nb_;
  m.C_now = q_nb_.toRotationMatrix();
  m.tau += dt;
}

void IntervalNavigator::sample(std::size_t index, double length, Moments& m, Interval& interval) {
  load(index);
  if (const Coast* lost = coast_at(index)) {
    interval.coasted = true;
    if (lost->gyros) {
      coast(*lost, index, length, m, interval);
      return;
    }
  }
  const double dt = sample_dt(index);
  // (N2), (N3): rotation vector with the coning term, velocity with the rotation and sculling terms; second-order
  // polynomials through this sample and the one before.
  constexpr double twelfth = 1.0 / 12.0, sixth = 1.0 / 6.0;
  const Vector3 turn = angle_ + twelfth * previous_angle_.cross(angle_);
  const Vector3 gain = velocity_ + 0.5 * angle_.cross(velocity_) + sixth * angle_.cross(angle_.cross(velocity_)) +
                       twelfth * (previous_angle_.cross(velocity_) + previous_velocity_.cross(angle_));
  const Eigen::Quaterniond step = quaternion_from_rotation_vector(turn);

  if (extra_ != nullptr && m.open && extra_->block_ends_before(sign_ > 0.0 ? index : index + 1)) {
    close_block(m, length);
  }
  if (!m.open) {
    m.open = true;
    m.block = SensorBlock{};
    m.C_block = m.C_now;
    m.tau_block = m.tau;
    m.block.first = index;
    m.block.last = index + 1;
    m.block.start_s = data_.time_s[index] - dt;
    m.block.end_s = data_.time_s[index];
  }
  Matrix3 C_start = m.C_now;
  if (sign_ > 0.0) {
    q_nb_ = q_nb_ * step;
    m.C_now = q_nb_.toRotationMatrix();
    m.block.last = index + 1;
    m.block.end_s = data_.time_s[index];
  } else {
    q_nb_ = q_nb_ * step.conjugate();
    m.C_now = q_nb_.toRotationMatrix();
    C_start = m.C_now;
    m.block.first = index;
    m.block.start_s = data_.time_s[index] - dt;
  }

  const Vector3 gain_n = C_start * gain;
  const double tau_middle = m.tau + 0.5 * dt;
  m.velocity += gain_n;
  m.velocity_tau += tau_middle * gain_n;
  m.velocity_rest += (length - tau_middle) * gain_n;
  m.tau += dt;

  m.block.integrals.dt += dt;
  m.block.integrals.angle += angle_;
  m.block.integrals.velocity_pos += velocity_.cwiseMax(0.0);
  m.block.integrals.velocity_neg += (-velocity_).cwiseMax(0.0);
  interval.angle_b += angle_;
  if (m.block.integrals.angle.squaredNorm() > block_turn * block_turn) {
    close_block(m, length);
  }
}

void IntervalNavigator::close_block(Moments& m, double length) {
  if (!m.open) {
    return;
  }
  m.open = false;
  const double dt = m.block.integrals.dt;
  const double rest = length - (m.tau_block + 0.5 * dt);
  const double rest2 = 0.5 * (rest * rest + dt * dt / 12.0);  // mean of (length - tau)^2 / 2 over the block
  m.block.C_nb = 0.5 * (m.C_block + m.C_now);
  const Matrix3& C = m.block.C_nb;
  if (force_ == ForceSource::gravity) {
    const Vector3 velocity = -dt * (C.transpose() * site_.gravity_n);
    m.block.integrals.velocity_pos = velocity.cwiseMax(0.0);
    m.block.integrals.velocity_neg = (-velocity).cwiseMax(0.0);
  }
  const SensorIntegrals& s = m.block.integrals;
  add_accel_sensitivity(C, s, 1.0, m.A0);
  add_accel_sensitivity(C, s, rest, m.A1);
  add_gyro_sensitivity(C, s, 1.0, m.W0);
  add_gyro_sensitivity(C, s, rest, m.W1);
  add_gyro_sensitivity(C, s, rest2, m.W2);
  if (extra_ != nullptr) {
    m.extra_velocity.setZero();
    m.extra_angle.setZero();
    extra_->block(m.block, m.extra_velocity, m.extra_angle);
    const Eigen::Matrix3Xd velocity_n = C * m.extra_velocity;
    const Eigen::Matrix3Xd angle_n = C * m.extra_angle;
    m.XA0 += velocity_n;
    m.XA1 += rest * velocity_n;
    m.XW0 += angle_n;
    m.XW1 += rest * angle_n;
    m.XW2 += rest2 * angle_n;
  }
}

bool IntervalNavigator::next(Interval& interval) {
  const std::size_t total = data_.size();
  if (done_ >= total) {
    return false;
  }
  const std::size_t count = std::min(samples_per_interval_, total - done_);
  interval.sign = sign_;
  interval.first = sign_ > 0.0 ? done_ : total - done_ - count;
  interval.last = interval.first + count;
  interval.start_s = data_.time_s[interval.first] - sample_dt(interval.first);
  interval.end_s = data_.time_s[interval.last - 1];
  interval.length_s = interval.end_s - interval.start_s;
  interval.angle_b.setZero();
  interval.coasted = false;
  interval.turned = -1;

  Moments m;
  if (extra_ != nullptr) {
    const auto zero = Eigen::Matrix3Xd::Zero(3, extra_->count());
    m.XA0 = m.XA1 = m.XW0 = m.XW1 = m.XW2 = m.extra_velocity = m.extra_angle = zero;
  }
  m.C_now = C_nb();
  for (std::size_t i = 0; i < count; ++i) {
    sample(sign_ > 0.0 ? interval.first + i : interval.last - 1 - i, interval.length_s, m, interval);
  }
  close_block(m, interval.length_s);
  finish(m, interval);
  done_ += count;
  return true;
}

void IntervalNavigator::finish(const Moments& m, Interval& interval) {
  const double T = interval.length_s;
  const double s = sign_;
  const Vector3 w = site_.omega_ie_n;
  // (N4): the sums are in n as it stood on entry; n turns by w during the interval.
  const Vector3 velocity = m.velocity - s * w.cross(m.velocity_tau);
  // int (T - tau)(C f - s tau w x C f): the second moment by its mean value, exact for constant f.
  const Vector3 position = m.velocity_rest - s * w.cross(m.velocity) * (T * T / 6.0);
  interval.f_n = velocity / T;
  Vector3 drift_p = position + site_.gravity_n * (T * T / 2.0);
  Vector3 drift_v = s * (velocity + site_.gravity_n * T);
  drift_v -= 2.0 * w.cross(drift_p);  // Coriolis on the drift
  interval.drive.setZero();
  interval.drive.segment<3>(StateLayout::position) = -drift_p;
  interval.drive.segment<3>(StateLayout::velocity) = -drift_v;
  q_nb_ = quaternion_from_rotation_vector(-s * T * w) * q_nb_;
  q_nb_.normalize();

  // (D4): Phi(T, tau) applied to the inputs, Earth rate over the interval neglected (7e-5 of a sensitivity).
  interval.Phi = transition(site_, interval.f_n, T, s);
  const Matrix3 S = skew(interval.f_n);
  interval.Gamma.setZero(9, sensor_parameter_count + (extra_ != nullptr ? extra_->count() : 0));
  for (int k = 0; k < accel_parameter_count; ++k) {
    const int at = accel_parameter_index[static_cast<std::size_t>(k)];
    interval.Gamma.col(at).segment<3>(StateLayout::position) = m.A1.col(k);
    interval.Gamma.col(at).segment<3>(StateLayout::velocity) = s * m.A0.col(k);
  }
  for (int k = 0; k < gyro_parameter_count; ++k) {
    const int at = gyro_parameter_index[static_cast<std::size_t>(k)];
    interval.Gamma.col(at).segment<3>(StateLayout::position) = -s * (S * m.W2.col(k));
    interval.Gamma.col(at).segment<3>(StateLayout::velocity) = -(S * m.W1.col(k));
    interval.Gamma.col(at).segment<3>(StateLayout::attitude) = -s * m.W0.col(k);
  }
  if (extra_ != nullptr) {
    auto extra = interval.Gamma.rightCols(extra_->count());
    extra.middleRows<3>(StateLayout::position) = m.XA1 - s * (S * m.XW2);
    extra.middleRows<3>(StateLayout::velocity) = s * m.XA0 - S * m.XW1;
    extra.middleRows<3>(StateLayout::attitude) = -s * m.XW0;
  }
  if (interval.coasted) {
    interval.drive.setZero();
    interval.Phi.topRows<6>().setZero();
    interval.Gamma.topRows<6>().setZero();
  }
}

}  // namespace selfcal
