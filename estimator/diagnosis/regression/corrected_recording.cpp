#include "estimator/diagnosis/regression/corrected_recording.hpp"

#include <utility>

#include "estimator/models/sensor_noise.hpp"

namespace selfcal::diagnosis {

CorrectedRecording::CorrectedRecording(const ImuData& original, AngleVelocity delta_theta, AngleVelocity delta_v)
    : increments_(std::make_shared<const Increments>(Increments{std::move(delta_theta), std::move(delta_v)})),
      data_(original) {
  data_.delta_theta = increments_->delta_theta;
  data_.delta_v = increments_->delta_v;
  data_.quanta = find_quanta(original);
}

CorrectedRecording::CorrectedRecording(const RecordingContext& context, PassInput about, Correction correction)
    : CorrectedRecording(context.data()) {
  if (correction.effects.empty()) {
    return;
  }
  const ImuData& original = context.data();
  AngleVelocity theta(original.delta_theta.begin(), original.delta_theta.end());
  AngleVelocity velocity(original.delta_v.begin(), original.delta_v.end());
  about.data = &original;
  subtract_effects(context, about, correction, theta, velocity);
  *this = CorrectedRecording(original, std::move(theta), std::move(velocity));
  correction_ = std::move(correction);
}

}  // namespace selfcal::diagnosis
