#include "estimator/diagnosis/holdout.hpp"

#include <algorithm>

#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal::diagnosis {
namespace {

// The findings' equations as columns; what cannot be carried over is named.
Correction carried(const Diagnosis& d, std::vector<std::string>& not_carried) {
  Correction correction;
  for (const ModelEffect& m : d.model) {
    correction.add(*m.effect, m.constant, m.size);
    if (m.effect->sensor == nullptr) {
      not_carried.push_back(m.effect->id);
    }
  }
  for (const Finding& f : d.findings) {
    if (f.stochastic) {
      not_carried.push_back(f.effect);
    }
  }
  return correction;
}

HeldOutState state_of(const Diagnosis& d, const ImuData& data, const CalibrationResult& calibration,
                      const NoiseModel& noise, const ParameterVector& of_first, const ParameterVector& first_sigma) {
  PassInput input = forward_pass(data, calibration);
  input.noise = noise;
  const RecordingContext context(data);
  const SignatureRows rows = SignaturePass(context, {}, false).run(input);
  HeldOutState state;
  state.log_likelihood = rows.pass.log_likelihood;
  state.nis = rows.residual.squaredNorm() / static_cast<double>(rows.residual.size());
  state.log_p_white = test_whiteness(rows.residual).log_p;
  state.parameter_disagreement =
      disagreement(of_first, first_sigma, calibration.value, calibration.sigma, d.calibration.determined);
  return state;
}

}  // namespace

double disagreement(const ParameterVector& first, const ParameterVector& first_sigma, const ParameterVector& second,
                    const ParameterVector& second_sigma, const std::array<bool, sensor_parameter_count>& determined) {
  double sum = 0.0;
  int seen = 0;
  for (int k = 0; k < sensor_parameter_count; ++k) {
    if (determined[static_cast<std::size_t>(k)]) {
      const double difference = second(k) - first(k);
      sum += difference * difference / (second_sigma(k) * second_sigma(k) + first_sigma(k) * first_sigma(k));
      ++seen;
    }
  }
  return sum / std::max(1, seen);
}

HoldoutOutcome hold_out(const Diagnosis& d, const ImuData& second, const DiagnosisOptions& options) {
  if (second.size() < 2) {
    return {std::nullopt, "the second recording is empty"};
  }
  Holdout result;
  const Correction correction = carried(d, result.not_carried);
  for (const Candidate& c : correction.effects) {
    if (c.effect->temperature == TemperatureUse::measured && second.temperature.empty()) {
      return {std::nullopt, c.effect->id + " was found with a temperature channel, and the second recording has none"};
    }
  }
  const CalibrationOutcome without = calibrate_still(second, options.calibration);
  if (!without.result) {
    return {std::nullopt, "the second recording: " + without.failure.message};
  }
  const RecordingContext context(second);
  const CorrectedRecording corrected(context, forward_pass(second, *without.result), correction);
  const CalibrationOutcome with = calibrate_still(corrected.data(), options.calibration);
  if (!with.result) {
    return {std::nullopt, "the second recording, corrected: " + with.failure.message};
  }
  const NoiseModel& noise = with.result->noise;
  result.before = state_of(d, second, *without.result, noise, d.calibration.value, d.calibration.sigma);
  result.after = state_of(d, corrected.data(), *with.result, noise, d.value, d.sigma);
  result.gain = result.after.log_likelihood - result.before.log_likelihood;
  return {std::move(result), {}};
}

}  // namespace selfcal::diagnosis
