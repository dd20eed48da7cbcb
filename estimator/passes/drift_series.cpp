#include "estimator/passes/drift_series.hpp"

#include <cmath>

namespace selfcal {
namespace {

constexpr double turning_rate = 0.1;  // rad/s: a gimbal's; a base sways more slowly
// 1 sigma of what the filter begins with, and of what the errors not yet found change when the gimbal turns.
constexpr double first_position = 1.0;       // m
constexpr double first_velocity = 0.2;       // m/s
constexpr double first_acceleration = 1e-2;  // m/s^2: a tilt of 1 mrad
constexpr double turn_acceleration = 1e-3;   // m/s^2 per interval: 100 ug
constexpr double gravity = 9.8;              // m/s^2

constexpr int drift_states = 3;  // position, velocity, acceleration
constexpr int most_states = drift_states + 2 * 8;
using State = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_states, 1>;
using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_states, most_states>;

class AxisFilter {
 public:
  AxisFilter(const DriftSeries& series, const DriftNoise& noise, const MotionModel& motion)
      : sT_(series.sign * series.interval_s), white_(noise.white_sigma * noise.white_sigma / series.interval_s) {
    const double T = series.interval_s;
    const Eigen::Index n = drift_states + motion.state_count();
    x_ = State::Zero(n);
    P_ = Covariance::Zero(n, n);
    P_.diagonal().head<3>() << first_position * first_position, first_velocity * first_velocity,
        first_acceleration * first_acceleration;
    Eigen::Index at = drift_states;
    for (const Oscillation& oscillation : motion.oscillations) {
      steps_.emplace_back(oscillation, T);
      P_.diagonal().segment<2>(at).setConstant(oscillation.sigma * oscillation.sigma);
      at += 2;
    }
    const double qa = noise.accel_vrw * noise.accel_vrw;
    q_pp_ = qa * T * T * T / 3.0;
    q_pv_ = series.sign * qa * T * T / 2.0;
    q_vv_ = qa * T;
    q_bb_ = gravity * gravity * noise.gyro_arw * noise.gyro_arw * T;
  }

  // `inflation`: of the noise in this interval and of the position observed at its end.
  void propagate(double drift_p, double drift_v, bool turning, double inflation) {
    inflation_ = inflation;
    step_rows(x_);
    x_(0) += drift_p;
    x_(1) += drift_v;
    step_rows(P_);
    step_columns(P_);
    P_(0, 0) += inflation * q_pp_;
    P_(0, 1) += inflation * q_pv_;
    P_(1, 0) += inflation * q_pv_;
    P_(1, 1) += inflation * q_vv_;
    P_(2, 2) += inflation * q_bb_ + (turning ? turn_acceleration * turn_acceleration : 0.0);
    for (std::size_t k = 0; k < steps_.size(); ++k) {
      const auto at = drift_states + 2 * static_cast<Eigen::Index>(k);
      P_(at, at) += inflation * steps_[k].drive_variance;
      P_(at + 1, at + 1) += inflation * steps_[k].drive_variance;
    }
  }

  // After an interval without observation: position and velocity as the filter begins, the tilt goes on.
  void start_anew(bool turning) {
    const double tilt = x_(2);
    const double variance = P_(2, 2) + (turning ? first_acceleration * first_acceleration : 0.0);
    x_.head<drift_states>() << 0.0, 0.0, tilt;
    P_.topRows<drift_states>().setZero();
    P_.leftCols<drift_states>().setZero();
    P_.diagonal().head<drift_states>() << first_position * first_position, first_velocity * first_velocity, variance;
  }

  // (M3). Returns the innovation and its variance.
  std::pair<double, double> update() {
    State Ph = P_.col(0);
    double predicted = x_(0);
    for (Eigen::Index at = drift_states; at < x_.size(); at += 2) {
      Ph += P_.col(at);
      predicted += x_(at);
    }
    double variance = inflation_ * white_ + Ph(0);
    for (Eigen::Index at = drift_states; at < x_.size(); at += 2) {
      variance += Ph(at);
    }
    x_ -= Ph * (predicted / variance);
    P_.noalias() -= Ph * (Ph / variance).transpose();
    return {-predicted, variance};
  }

 private:
  // Transition from the left: every column of m.
  template <typename Matrix>
  void step_rows(Matrix& m) const {
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      double* column = m.col(j).data();
      column[0] += sT_ * column[1] + 0.5 * sT_ * sT_ * column[2];
      column[1] += sT_ * column[2];
      double* pair = column + drift_states;
      for (const OscillationStep& step : steps_) {
        const double c = pair[0];
        pair[0] = step.cosine * c - step.sine * pair[1];
        pair[1] = step.sine * c + step.cosine * pair[1];
        pair += 2;
      }
    }
  }
  void step_columns(Covariance& m) const {
    m.col(0) += sT_ * m.col(1) + 0.5 * sT_ * sT_ * m.col(2);
    m.col(1) += sT_ * m.col(2);
    Eigen::Index at = drift_states;
    for (const OscillationStep& step : steps_) {
      const State c = m.col(at);
      m.col(at) = step.cosine * c - step.sine * m.col(at + 1);
      m.col(at + 1) = step.sine * c + step.cosine * m.col(at + 1);
      at += 2;
    }
  }

  double sT_, white_, inflation_ = 1.0;
  double q_pp_ = 0.0, q_pv_ = 0.0, q_vv_ = 0.0, q_bb_ = 0.0;
  std::vector<OscillationStep> steps_;
  State x_;
  Covariance P_;
};

}  // namespace

DriftSeries drift_series(const PassInput& input) {
  DriftSeries series;
  series.interval_s = input.interval_s;
  series.sign = input.sign;
  IntervalNavigator navigator(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s);
  Interval interval;
  while (navigator.next(interval)) {
    if (interval.coasted || std::abs(interval.length_s - input.interval_s) <= 0.1 * input.interval_s) {
      series.position.emplace_back(interval.drive.segment<3>(StateLayout::position));
      series.velocity.emplace_back(interval.drive.segment<3>(StateLayout::velocity));
      series.coasted.push_back(interval.coasted);
      series.turning.push_back(interval.turned >= 0 || interval.angle_b.norm() > turning_rate * interval.length_s);
      series.start_s.push_back(interval.start_s);
      series.end_s.push_back(interval.end_s);
    }
  }
  return series;
}

void filter_axis(const DriftSeries& series, int axis, const DriftNoise& noise, const MotionModel& motion,
                 AxisInnovations& out) {
  AxisFilter filter(series, noise, motion);
  const auto count = static_cast<Eigen::Index>(series.size());
  out.value.resize(count);
  out.variance.resize(count);
  filter.update();  // where the pass begins the position is known as well
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (!series.coasted.empty() && series.coasted[i]) {
      filter.propagate(0.0, 0.0, series.turning[i], 1.0);
      filter.start_anew(series.turning[i]);
      filter.update();
      out.value(k) = 0.0;  // no innovation
      out.variance(k) = 1.0;
      continue;
    }
    filter.propagate(series.position[i](axis), series.velocity[i](axis), series.turning[i],
                     series.inflation.empty() ? 1.0 : series.inflation[i]);
    std::tie(out.value(k), out.variance(k)) = filter.update();
  }
  out.log_likelihood = -0.5 * (out.value.square() / out.variance + out.variance.log()).sum();
}

}  // namespace selfcal
