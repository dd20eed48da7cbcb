// A recording's increments less effects of given sizes.
#pragma once

#include <memory>

#include "estimator/diagnosis/regression/signature_pass.hpp"

namespace selfcal::diagnosis {

// A value: copies share the increments, which nobody changes. Site, times, read-outs and temperature stay those of the
// original, which must outlive it.
class CorrectedRecording {
 public:
  CorrectedRecording() = default;
  // Nothing taken out.
  explicit CorrectedRecording(const ImuData& original) : data_(original) {}
  // Other increments in the place of the original's. The sensors' quanta stay in them as noise: they are the original's.
  CorrectedRecording(const ImuData& original, AngleVelocity delta_theta, AngleVelocity delta_v);
  // `correction` taken out of the context's recording; attitude along it comes from navigating with `about`'s parameters and
  // start, whatever its data.
  CorrectedRecording(const RecordingContext& context, PassInput about, Correction correction);

  const ImuData& data() const { return data_; }
  const Correction& taken_out() const { return correction_; }

 private:
  struct Increments {
    AngleVelocity delta_theta, delta_v;
  };
  std::shared_ptr<const Increments> increments_;  // behind `data_`; null: the original's
  ImuData data_;
  Correction correction_;
};

}  // namespace selfcal::diagnosis
