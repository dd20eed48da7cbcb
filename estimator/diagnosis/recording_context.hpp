// What the equations of effects need to know of each stretch of the recording.
#pragma once

#include <vector>

#include "estimator/diagnosis/effect.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/navigation/interval_navigator.hpp"

namespace selfcal::diagnosis {

// Field of an axial dipole at the surface, n, gauss: 0.31 at the equator.
Vector3 dipole_field(double latitude);

class RecordingContext {
 public:
  // `data` must outlive this.
  explicit RecordingContext(const ImuData& data);

  EffectContext of(const SensorBlock& block) const;
  // Index of the segment that holds time t (clamped to the recording).
  std::size_t segment_at(double t) const;

  const ImuData& data() const { return data_; }
  const std::vector<Segment>& segments() const { return segments_; }
  double mean_temperature() const { return mean_temperature_; }   // degC, where there is a channel
  bool has_temperature() const { return !data_.temperature.empty(); }

 private:
  Vector3 rate_at(std::size_t sample) const;   // near the boundary before `sample`, zero in dwells

  const ImuData& data_;
  std::vector<Segment> segments_;
  double start_s_, mean_temperature_ = 0.0;
  Vector3 field_n_;   // gauss
};

}  // namespace selfcal::diagnosis
