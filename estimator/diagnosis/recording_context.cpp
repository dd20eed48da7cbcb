#include "estimator/diagnosis/recording_context.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace selfcal::diagnosis {
Vector3 dipole_field(double latitude) {
  constexpr double equator = 0.31;
  return equator * Vector3(std::cos(latitude), -2.0 * std::sin(latitude), 0.0);
}

RecordingContext::RecordingContext(const ImuData& data)
    : data_(data),
      segments_(find_segments(data)),
      start_s_(data.time_s.front() - 1.0 / data.sample_rate_hz),
      field_n_(dipole_field(data.site.latitude)) {
  if (has_temperature()) {
    mean_temperature_ = std::accumulate(data.temperature.begin(), data.temperature.end(), 0.0) /
                        static_cast<double>(data.temperature.size());
  }
}

std::size_t RecordingContext::segment_at(double t) const {
  const auto after = std::upper_bound(segments_.begin(), segments_.end(), t,
                                      [](double value, const Segment& s) { return value < s.end_s; });
  return std::min(static_cast<std::size_t>(after - segments_.begin()), segments_.size() - 1);
}

// Mean over two samples on either side: the gyro's quantum would swamp the difference of single ones.
Vector3 RecordingContext::rate_at(std::size_t sample) const {
  constexpr std::size_t half = 2;
  const std::size_t first = sample > half ? sample - half : 0;
  const std::size_t last = std::min(sample + half, data_.size());
  const double t = data_.time_s[std::min(sample, data_.size() - 1)];
  if (!segments_[segment_at(t)].rotation) {
    return Vector3::Zero();
  }
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = first; i < last; ++i) {
    sum += Eigen::Map<const Vector3>(data_.delta_theta[i].data());
  }
  return sum * data_.sample_rate_hz / static_cast<double>(last - first);
}

EffectContext RecordingContext::of(const SensorBlock& block) const {
  EffectContext c;
  c.start_s = block.start_s - start_s_;
  c.end_s = block.end_s - start_s_;
  c.dt = block.integrals.dt;
  c.angle = block.integrals.angle;
  c.velocity = block.integrals.velocity_pos - block.integrals.velocity_neg;
  c.rate = c.angle / c.dt;
  c.force = c.velocity / c.dt;
  c.u = c.force / 9.80665;
  c.rate_change = rate_at(block.last) - rate_at(block.first);
  c.C_nb = block.C_nb;
  c.field_b = block.C_nb.transpose() * field_n_;
  c.earth_rate_b = block.C_nb.transpose() * Vector3(std::cos(data_.site.latitude), std::sin(data_.site.latitude), 0.0);
  c.duration_s = data_.time_s.back() - start_s_;
  for (std::size_t k = segment_at(block.start_s); k <= segment_at(block.end_s - 1e-9); ++k) {
    const Segment& s = segments_[k];
    if (!s.rotation && k > 0) {
      c.since_turn_start_s = std::max(block.start_s, s.start_s) - s.start_s;
      c.since_turn_end_s = std::max(std::min(block.end_s, s.end_s) - s.start_s, c.since_turn_start_s);
    }
  }
  // What creeps after a turn goes on creeping while the next one is made.
  const std::size_t here = segment_at(block.start_s);
  if (segments_[here].rotation && here == segment_at(block.end_s - 1e-9) && here >= 2) {
    c.since_turn_start_s = block.start_s - segments_[here - 2].end_s;
    c.since_turn_end_s = block.end_s - segments_[here - 2].end_s;
  }
  const std::size_t middle = (block.first + block.last) / 2;
  if (!data_.gimbal_outer.empty() && !data_.gimbal_inner.empty()) {
    c.outer = data_.gimbal_outer[middle];
    c.inner = data_.gimbal_inner[middle];
  }
  if (has_temperature()) {
    double sum = 0.0;
    for (std::size_t i = block.first; i < block.last; ++i) {
      sum += data_.temperature[i];
    }
    c.temperature = sum / static_cast<double>(block.last - block.first) - mean_temperature_;
  }
  return c;
}

}  // namespace selfcal::diagnosis
