#include "estimator/diagnosis/still_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

namespace {

// Whatever is left out makes innovations larger. Where they are far smaller than predicted the densities were taken
// too large: lines and a coarse quantum beside little white noise do that to a spectrum.
CalibrationOutcome with_smaller_noise(const ImuData& data, CalibrationOptions options, CalibrationOutcome outcome,
                                      const std::stop_token& stop) {
  constexpr double far_below_one = 0.5;
  constexpr int rounds = 3;
  for (int round = 0; round < rounds && outcome.result && outcome.result->consistency.nis_mean < far_below_one;
       ++round) {
    const double scale = std::sqrt(outcome.result->consistency.nis_mean);
    options.noise.gyro_arw = scale * outcome.result->gyro_arw;
    options.noise.accel_vrw = scale * outcome.result->accel_vrw;
    outcome = calibrate(data, options, {}, stop);
  }
  return outcome;
}

}  // namespace

bool turned(const ImuData& data) {
  const std::vector<Segment> segments = find_segments(data);
  return std::any_of(segments.begin(), segments.end(), [](const Segment& s) { return s.rotation; });
}

CalibrationOutcome calibrate_still(const ImuData& data, CalibrationOptions options, const std::stop_token& stop) {
  constexpr double largest_still_sigma = 3e-6;  // m: a calibration that asks for more does so because of an omission
  // Noise fitted to the drift takes up what was left out; where the sensors turned it is left to the steps of the search, which fit
  // a coarse quantum beside what is named (noise/velocity_noise.hpp).
  options.noise_of_drift = !turned(data);
  CalibrationOutcome outcome = calibrate(data, options, {}, stop);
  const bool widened = outcome.result && !outcome.result->moored && !outcome.result->noise_of_drift &&
                       outcome.result->position_sigma > largest_still_sigma;
  if (widened && !options.noise.position_sigma) {
    options.noise.position_sigma = largest_still_sigma;
    outcome = calibrate(data, options, {}, stop);
  }
  if (!options.noise.gyro_arw && !options.noise.accel_vrw && outcome.result && !outcome.result->moored &&
      !outcome.result->noise_of_drift) {
    outcome = with_smaller_noise(data, options, std::move(outcome), stop);
  }
  return outcome;
}

PassInput forward_pass(const ImuData& data, const CalibrationResult& calibration) {
  PassInput input;
  input.data = &data;
  input.parameters = calibration.linearised_value;
  input.C_nb = calibration.linearised_C_nb;
  input.held = calibration.held;
  input.noise = calibration.noise;
  input.force = calibration.noise_of_drift ? ForceSource::gravity : ForceSource::accelerometers;
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  return input;
}

}  // namespace selfcal::diagnosis
