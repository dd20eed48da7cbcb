#include "estimator/passes/pass.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal {
namespace {

constexpr double history_points = 200.0;

// The dynamic part of the state: navigation errors and, behind them, the oscillations of the base.
struct DynamicModel {
  MatrixX Phi, L;
  VectorX q, drive;
  std::array<VectorX, 3> h;  // observation row of each axis

  DynamicModel(const ObservationModel& observation, double interval_s, const ProcessNoise& noise) {
    const int d = StateLayout::navigation_count + observation.state_count();
    Phi = MatrixX::Zero(d, d);
    L = MatrixX::Identity(d, d);  // the motion states are driven one by one
    q = VectorX::Zero(d);
    drive = VectorX::Zero(d);
    L.topLeftCorner<9, 9>() = noise.L;
    q.head<9>() = noise.q;
    Phi.bottomRightCorner(observation.state_count(), observation.state_count()) = observation.transition(interval_s);
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
};

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
  sigma.tail(layout.constant_count()) = input.prior.parameter_sigma;
  return sigma;
}

UdFilter make_filter(const PassInput& input, const StateLayout& layout) {
  VectorX mean = VectorX::Zero(layout.count());
  if (!input.prior.carried) {  // the prior is about zero, the state about the linearisation
    mean.segment<sensor_parameter_count>(layout.parameters()) = -input.parameters;
  }
  if (input.extra_prior_mean.size() > 0) {
    mean.tail(layout.extra_count) = input.extra_prior_mean;
  }
  UdFilter filter(mean, prior_sigma(input, layout), layout.constant_count());
  if (input.prior.carried) {
    filter.set_constant_covariance(*input.prior.carried);
  }
  return filter;
}

}  // namespace

double NoiseModel::inflation(double time_s) const {
  const auto after = std::upper_bound(disturbed.begin(), disturbed.end(), time_s,
                                      [](double t, const Disturbance& d) { return t < d.end_s; });
  return after != disturbed.end() && after->start_s <= time_s ? after->factor : 1.0;
}

PassOutput run_pass(const PassInput& input, const PassProgress& progress, const std::stop_token& stop,
                    PassObserver* observer) {
  PassOutput out;
  out.layout.observation_count = input.noise.observation.state_count();
  out.layout.extra_count = input.extra != nullptr ? input.extra->count() : 0;
  const StateLayout& layout = out.layout;
  UdFilter filter = make_filter(input, layout);
  IntervalNavigator navigator(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, input.extra,
                              input.force);
  DynamicModel model(
      input.noise.observation, input.interval_s,
      process_noise(navigator.site(), input.noise.gyro_arw, input.noise.accel_vrw, input.interval_s, input.sign));
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
  while (navigator.next(interval)) {
    if (stop.stop_requested()) {
      out.stopped = true;
      return out;
    }
    model.Phi.topLeftCorner<9, 9>() = interval.Phi;
    model.drive.head<9>() = interval.drive;
    Gamma.topRows<9>() = interval.Gamma;
    const double inflation = input.noise.inflation(0.5 * (interval.start_s + interval.end_s));
    filter.propagate(model.Phi, Gamma, model.drive, model.L, inflation * model.q);
    ++index;
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
  out.mean = filter.mean();
  out.covariance = filter.covariance();
  out.C_nb = matrix_from_rotation_vector(out.mean.segment<3>(StateLayout::attitude)) * navigator.C_nb();
  return out;
}

}  // namespace selfcal
