#include "estimator/discovery/named_effects.hpp"

#include <algorithm>

#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::discovery {
namespace {

bool names(const diagnosis::Diagnosis& d, const diagnosis::Effect* effect) {
  return std::any_of(d.findings.begin(), d.findings.end(),
                     [&](const diagnosis::Finding& f) { return f.source == effect; });
}

diagnosis::CorrectedRecording without(const ImuData& data, const diagnosis::Diagnosis& d,
                                      const std::vector<const diagnosis::Effect*>& effects) {
  diagnosis::Correction correction;
  for (const diagnosis::ModelEffect& effect : d.model) {
    if (names(d, effect.effect) && std::find(effects.begin(), effects.end(), effect.effect) != effects.end()) {
      correction.add(*effect.effect, effect.constant, effect.size);
    }
  }
  PassInput input = diagnosis::forward_pass(data, d.calibration);
  input.parameters = d.value_as_named;
  return {diagnosis::RecordingContext(data), input, std::move(correction)};
}

std::vector<const diagnosis::Effect*> to_be_taken_out(std::span<const DiagnosedRecording> unit) {
  const bool one_unexplained =
      std::any_of(unit.begin(), unit.end(), [](const DiagnosedRecording& r) { return r.diagnosis.unexplained; });
  std::vector<const diagnosis::Effect*> effects;
  for (const DiagnosedRecording& r : unit) {
    for (const diagnosis::Finding& f : r.diagnosis.findings) {
      const bool known = std::find(effects.begin(), effects.end(), f.source) != effects.end();
      const bool in_all = std::all_of(
          unit.begin(), unit.end(), [&](const DiagnosedRecording& other) { return names(other.diagnosis, f.source); });
      if (f.source != nullptr && !known && (in_all || !one_unexplained)) {
        effects.push_back(f.source);
      }
    }
  }
  return effects;
}

}  // namespace

tl::expected<UnexplainedRest, std::string> UnexplainedRest::of(std::span<const DiagnosedRecording> unit,
                                                               const std::stop_token& stop) {
  UnexplainedRest rest;
  rest.taken_out_ = to_be_taken_out(unit);
  for (const DiagnosedRecording& r : unit) {
    auto corrected = std::make_unique<diagnosis::CorrectedRecording>(without(r.data, r.diagnosis, rest.taken_out_));
    CalibrationOutcome calibration = diagnosis::calibrate_still(corrected->data(), {}, stop);
    if (!calibration.result) {
      return tl::unexpected(calibration.failure.message);
    }
    rest.calibrations_.push_back(std::make_unique<CalibrationResult>(std::move(*calibration.result)));
    rest.recordings_.push_back({corrected->data(), *rest.calibrations_.back()});
    rest.corrected_.push_back(std::move(corrected));
  }
  return rest;
}

}  // namespace selfcal::discovery
