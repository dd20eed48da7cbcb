#include "estimator/discovery/named_effects.hpp"

#include <algorithm>

#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::discovery {

diagnosis::CorrectedRecording without_named(const ImuData& data, const diagnosis::Diagnosis& d) {
  diagnosis::Correction correction;
  for (const diagnosis::ModelEffect& effect : d.model) {
    const bool named = std::any_of(d.findings.begin(), d.findings.end(),
                                   [&](const diagnosis::Finding& f) { return f.source == effect.effect; });
    if (named) {
      correction.add(*effect.effect, effect.constant, effect.size);
    }
  }
  PassInput input = diagnosis::forward_pass(data, d.calibration);
  input.parameters = d.value_as_named;
  return {diagnosis::RecordingContext(data), input, std::move(correction)};
}

}  // namespace selfcal::discovery
