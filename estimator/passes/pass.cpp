#include "estimator/passes/pass.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal {
namespace {

constexpr double history_points = 200.0;

// Noise and observation of the dynamic part of the state.
struct DynamicModel {
  MatrixX L;
  VectorX q, drive;
  std::array<VectorX, 3> h;  // observation row of each axis

  DynamicModel(const ObservationModel& observation, const StateLayout& layout, double interval_s,
               const ProcessNoise& noise) {
    const int d = layout.dynamic_count();
    L = MatrixX::Identity(d, d);  // motion and biases are driven one by one
    q = VectorX::Zero(d);
    drive = VectorX::Zero(d);
    set(noise);
    int at = StateLayout::navigation_count;
    for (int axis = 0; axis < 3; ++axis) {
      VectorX& row = h[static_cast<std::size_t>(axis)];
      row = VectorX::Zero(d);
      row(StateLayout::position + axis) = 1.0;
      for (const Oscillation& oscillation : observation.motion[static_cast<std::size_t>(axis)].oscillations) {
        row(at) = 1.0;
        q.segment<2>(at).setConstant(OscillationStep(oscillation, interval_s).drive_variance);
        at += 2;
      }
    }
  }

  void set(const ProcessNoise& noise) {
    L.topLeftCorner<9, 9>() = noise.L;
    q.head<9>() = noise.q;
  }
};

// Mean over an interval that begins and ends at these attitudes: exact where nothing turns.
WhiteNoise along_n(const AxisDensities& axes, const Matrix3& C_first, const Matrix3& C_last) {
  const auto mean = [&](const Vector3& density) -> Matrix3 {
    const auto D = density.cwiseAbs2().asDiagonal();
    return 0.5 * (C_first * D * C_first.transpose() + C_last * D * C_last.transpose());
  };
  return {mean(axes.gyro_arw), mean(axes.accel_vrw), mean(axes.accel_integral)};
}

// Noise of an interval without observation: position and velocity are as unknown as where a pass begins, and the attitude
// wanders no less than if the gyros had held it.
class CoastNoise {
 public:
  CoastNoise(const PassInput& input, const DynamicModel& model)
      : prior_(input.prior), constants_(input.turns_are_constants), L_(model.L), q_(model.q) {
    L_.topLeftCorner<9, 9>().setIdentity();
    attitude_ = input.noise.gyro_arw * input.noise.gyro_arw;
  }
  MatrixX& L() { return L_; }
  const VectorX& q(const Interval& interval) {
    const double opened = interval.turned >= 0 && !constants_ ? prior_.attitude * prior_.attitude : 0.0;
    q_.segment<3>(StateLayout::position).setConstant(prior_.position * prior_.position);
    q_.segment<3>(StateLayout::velocity).setConstant(prior_.velocity * prior_.velocity);
    q_.segment<3>(StateLayout::attitude).setConstant(attitude_ * interval.length_s + opened);
    return q_;
  }

 private:
  const PriorModel& prior_;
  bool constants_;
  MatrixX L_;
  VectorX q_;
  double attitude_;
};

// The turns that the gyros did not see. Where they are constants of the state, each opens the attitude by a rotation in n of its own.
class UnseenTurns {
 public:
  UnseenTurns(const PassInput& input, const StateLayout& layout)
      : input_(input), first_(layout.turns()), at_(input.data->coasts.size(), -1), C_nb_(input.data->coasts.size()) {
    int at = 0;
    for (std::size_t k = 0; k < at_.size() && layout.turn_count > 0; ++k) {
      if (input.data->coasts[k].turned) {
        at_[k] = at;
        at += 3;
      }
    }
  }
  static int count(const PassInput& input) {
    const auto& coasts = input.data->coasts;
    const auto turned = std::count_if(coasts.begin(), coasts.end(), [](const Coast& c) { return c.turned; });
    return input.turns_are_constants ? 3 * static_cast<int>(turned) : 0;
  }
  // `C_nb`: before the interval, in the direction of the pass.
  void open(const Interval& interval, const Matrix3& C_nb, Eigen::Ref<MatrixX> of_constants) {
    of_constants.setZero();
    if (interval.turned < 0) {
      return;
    }
    const auto k = static_cast<std::size_t>(interval.turned);
    C_nb_[k] = C_nb;
    if (at_[k] >= 0) {
      of_constants.block<3, 3>(StateLayout::attitude, at_[k]).setIdentity();
    }
  }
  std::vector<Matrix3> known(const VectorX& mean) const {
    std::vector<Matrix3> turns;
    for (std::size_t k = 0; k < at_.size(); ++k) {
      const Matrix3& turn = input_.data->coasts[k].turn;
      turns.push_back(turn);
      if (at_[k] >= 0) {
        const Matrix3 opened = C_nb_[k].transpose() *
                               matrix_from_rotation_vector(input_.sign * mean.segment<3>(first_ + at_[k])) * C_nb_[k];
        turns.back() = input_.sign > 0.0 ? Matrix3(opened * turn) : Matrix3(turn * opened);
      }
    }
    return turns;
  }

 private:
  const PassInput& input_;
  int first_;
  std::vector<int> at_;        // [coasts] among the constants of turns; -1: none
  std::vector<Matrix3> C_nb_;  // [coasts] where it opens
};

double factor_at(const std::vector<Disturbance>& all, double time_s) {
  const auto after =
      std::upper_bound(all.begin(), all.end(), time_s, [](double t, const Disturbance& d) { return t < d.end_s; });
  return after != all.end() && after->start_s <= time_s ? after->factor : 1.0;
}

VectorX prior_sigma(const PassInput& input, const StateLayout& layout) {
  VectorX sigma(layout.count());
  sigma.segment<3>(StateLayout::position).setConstant(input.prior.position);
  sigma.segment<3>(StateLayout::velocity).setConstant(input.prior.velocity);
  sigma.segment<3>(StateLayout::attitude).setConstant(input.prior.attitude);
  int at = layout.observation();
  for (const MotionModel& motion : input.noise.observation.motion) {
    for (const Oscillation& oscillation : motion.oscillations) {
      sigma.segment<2>(at).setConstant(oscillation.sigma);
      at += 2;
    }
  }
  for (const BiasNoise& bias : input.noise.biases) {
    sigma(at++) = bias.sigma;
  }
  sigma.segment(layout.parameters(), layout.turns() - layout.parameters()) = input.prior.parameter_sigma;
  sigma.tail(layout.turn_count).setConstant(input.prior.attitude);
  return sigma;
}

UdFilter make_filter(const PassInput& input, const StateLayout& layout) {
  VectorX mean = VectorX::Zero(layout.count());
  if (!input.prior.carried) {  // the prior is about zero, the state about the linearisation
    mean.segment<sensor_parameter_count>(layout.parameters()) = -input.parameters;
  }
  if (input.extra_prior_mean.size() > 0) {
    mean.segment(layout.turns() - layout.extra_count, layout.extra_count) = input.extra_prior_mean;
  }
  UdFilter filter(mean, prior_sigma(input, layout), layout.constant_count());
  if (input.prior.carried) {
    filter.set_constant_covariance(*input.prior.carried);
  }
  return filter;
}

}  // namespace

double NoiseModel::inflation(double time_s) const { return factor_at(disturbed, time_s); }

double NoiseModel::shaking(double time_s) const { return factor_at(shaken, time_s); }

Navigated navigate(const PassInput& input) {
  IntervalNavigator navigator(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, nullptr,
                              input.force);
  Navigated all;
  for (Interval interval; navigator.next(interval);) {
    all.intervals.push_back(interval);
    all.C_nb.push_back(navigator.C_nb());
  }
  return all;
}

PassOutput run_pass(const PassInput& input, const PassProgress& progress, const std::stop_token& stop,
                    PassObserver* observer) {
  PassOutput out;
  out.layout.observation_count = input.noise.observation.state_count();
  out.layout.bias_count = static_cast<int>(input.noise.biases.size());
  out.layout.extra_count = input.extra != nullptr ? input.extra->count() : 0;
  out.layout.turn_count = UnseenTurns::count(input);
  const StateLayout& layout = out.layout;
  UdFilter filter = make_filter(input, layout);
  IntervalNavigator navigator(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, input.extra,
                              input.force);
  DynamicTransition transition(input.noise.observation, input.noise.biases, input.interval_s);
  DynamicModel model(
      input.noise.observation, layout, input.interval_s,
      process_noise(navigator.site(), input.noise.gyro_arw, input.noise.accel_vrw, input.interval_s, input.sign));
  CoastNoise coast_noise(input, model);
  UnseenTurns turns(input, layout);
  const double noise_variance = input.noise.observation.sigma * input.noise.observation.sigma / input.interval_s;
  const int d = layout.dynamic_count();
  const double intervals = static_cast<double>(input.data->size()) / input.data->sample_rate_hz / input.interval_s;
  const int history_step = std::max(1, static_cast<int>(intervals / history_points));
  out.epochs.reserve(static_cast<std::size_t>(intervals) + 2);

  MatrixX Gamma = MatrixX::Zero(d, layout.constant_count());
  Interval interval;
  int index = 0;
  double nis = 0.0;
  const auto record_history = [&] {
    const VectorX variance = filter.variances();
    out.history_s.push_back(input.sign > 0.0 ? interval.end_s : interval.start_s);
    out.history_value.emplace_back(input.parameters +
                                   filter.mean().segment<sensor_parameter_count>(layout.parameters()));
    out.history_sigma.emplace_back(variance.segment<sensor_parameter_count>(layout.parameters()).cwiseSqrt());
    if (progress) {
      progress(std::min(1.0, index / intervals), out.history_value.back(), out.history_sigma.back());
    }
  };
  for (const VectorX& h : model.h) {  // where the pass begins the position is known as well
    filter.update(h, 0.0, noise_variance);
  }
  std::size_t replayed = 0;
  Matrix3 C_nb = navigator.C_nb(), C_before = C_nb;
  const auto next = [&] {
    C_before = C_nb;
    if (input.navigated == nullptr) {
      const bool more = navigator.next(interval);
      C_nb = navigator.C_nb();
      return more;
    }
    if (replayed == input.navigated->intervals.size()) {
      return false;
    }
    interval = input.navigated->intervals[replayed];
    C_nb = input.navigated->C_nb[replayed++];
    return true;
  };
  while (next()) {
    if (stop.stop_requested()) {
      out.stopped = true;
      return out;
    }
    model.drive.head<9>() = interval.drive;
    Gamma.topLeftCorner(9, interval.Gamma.cols()) = interval.Gamma;
    turns.open(interval, C_before, Gamma.rightCols(layout.turn_count));
    if (input.noise.axes) {
      WhiteNoise white = along_n(*input.noise.axes, C_before, C_nb);
      const double shaking = input.noise.shaking(0.5 * (interval.start_s + interval.end_s));
      white.force *= shaking;
      white.velocity *= shaking;
      model.set(process_noise(navigator.site(), white, input.interval_s, input.sign));
    }
    const double inflation = input.noise.inflation(0.5 * (interval.start_s + interval.end_s));
    MatrixX& L = interval.coasted ? coast_noise.L() : model.L;
    VectorX q = interval.coasted ? coast_noise.q(interval) : VectorX(inflation * model.q);
    if (layout.bias_count > 0) {
      L.rightCols(layout.bias_count) = transition.drive(interval);
      for (int k = 0; k < layout.bias_count; ++k) {
        q(layout.biases() + k) = input.noise.biases[static_cast<std::size_t>(k)].drive_variance(interval);
      }
    }
    filter.propagate(transition.over(interval), Gamma, model.drive, L, q);
    ++index;
    if (interval.coasted) {
      if (observer != nullptr) {
        observer->propagated(interval, filter);
      }
      for (const VectorX& h : model.h) {  // as where the pass begins
        filter.update(h, 0.0, noise_variance);
      }
      continue;
    }
    if (std::abs(interval.length_s - input.interval_s) > 0.1 * input.interval_s) {
      continue;  // the remainder at the end of the data: noise and motion are those of a whole interval
    }
    if (observer != nullptr) {
      observer->propagated(interval, filter);
    }
    Epoch epoch;
    epoch.time_s = input.sign > 0.0 ? interval.end_s : interval.start_s;
    epoch.interval_middle_s = 0.5 * (interval.start_s + interval.end_s);
    for (int axis = 0; axis < 3; ++axis) {
      const VectorX& h = model.h[static_cast<std::size_t>(axis)];
      const ScalarInnovation innovation = filter.update(h, 0.0, inflation * noise_variance);
      if (observer != nullptr) {
        observer->updated(axis, h, innovation, filter);
      }
      epoch.innovation(axis) = innovation.value;
      epoch.variance(axis) = innovation.variance;
      nis += innovation.value * innovation.value / innovation.variance;
      out.log_likelihood -= 0.5 * (innovation.value * innovation.value / innovation.variance +
                                   std::log(2.0 * std::numbers::pi * innovation.variance));
    }
    epoch.position = filter.mean().segment<3>(StateLayout::position);
    out.epochs.push_back(epoch);
    if (index % history_step == 0) {
      record_history();
    }
  }
  record_history();
  out.nis_mean = out.epochs.empty() ? 0.0 : nis / (3.0 * static_cast<double>(out.epochs.size()));
  out.turns = turns.known(filter.mean());
  out.mean = filter.mean();
  out.covariance = filter.covariance();
  out.C_nb = matrix_from_rotation_vector(out.mean.segment<3>(StateLayout::attitude)) * C_nb;
  return out;
}

}  // namespace selfcal
