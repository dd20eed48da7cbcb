// What the equations of effects need to know of each stretch of the recording.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"
#include "estimator/diagnosis/regression/innovation_colour.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/navigation/interval_navigator.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

// Field of an axial dipole at the surface, n, gauss: 0.31 at the equator.
Vector3 dipole_field(double latitude);

// Whitened innovations of another recording of the same schedule, by a forward pass with this noise.
using ReferenceResidual = std::function<const Eigen::VectorXd&(const NoiseModel&)>;

// A turn of the gimbal, recording's time, s: from where the rate sets in to where it runs out.
struct Turn {
  double start_s = 0.0, end_s = 0.0;
};

class RecordingContext {
 public:
  // `data` must outlive this. With a reference the rows of signature passes are those of the difference, over sqrt(2).
  explicit RecordingContext(const ImuData& data, ReferenceResidual reference = {});

  EffectContext of(const SensorBlock& block) const;
  // Whether a stretch is to end before this sample. In and around turns stretches are short: what sets in with a turn must
  // not be spread over the second before it. After a turn they are not long: what creeps falls within a second.
  bool divides(std::size_t sample) const;
  // Index of the segment that holds time t (clamped to the recording).
  std::size_t segment_at(double t) const;

  const ImuData& data() const { return data_; }
  const std::vector<Segment>& segments() const { return segments_; }
  const std::vector<Turn>& turns() const { return turns_; }          // in order of time
  double mean_temperature() const { return mean_temperature_; }      // degC, where there is a channel
  const ReferenceResidual& reference() const { return reference_; }  // may be empty
  // Taken from the rows of signature passes; white unless it was set.
  const InnovationColour& colour() const { return colour_; }
  void set_colour(InnovationColour colour) { colour_ = std::move(colour); }
  bool has_temperature() const { return !data_.temperature.empty(); }

 private:
  Vector3 rate_at(std::size_t sample) const;                     // at the boundary before `sample`, zero in dwells
  Vector3 mean_rate(std::size_t first, std::size_t last) const;  // of samples [first, last)
  bool turns_around(double t) const;
  double start_of_turn(const Segment& rotation) const;
  double end_of_turn(const Segment& rotation) const;
  void remember_turns();
  Vector3 load(std::size_t first, std::size_t last) const;      // mean over samples [first, last), g
  double travelled(std::size_t first, std::size_t last) const;  // by the gimbal's axes together, rad
  bool collect_ramp(std::size_t first, std::size_t last, std::vector<double>& time, std::vector<double>& rate) const;

  const ImuData& data_;
  ReferenceResidual reference_;
  InnovationColour colour_;
  std::vector<Segment> segments_;
  std::vector<Turn> turns_;
  TurnMemory load_memory_{{}}, travel_memory_{{}};
  std::size_t samples_per_division_;  // 20 ms
  double start_s_, mean_temperature_ = 0.0;
  Vector3 field_n_;  // gauss
};

}  // namespace selfcal::diagnosis
