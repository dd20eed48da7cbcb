#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::diagnosis {

CalibrationOutcome calibrate_still(const ImuData& data, CalibrationOptions options) {
  constexpr double largest_still_sigma = 3e-6;   // m: a calibration that asks for more does so because of an omission
  CalibrationOutcome outcome = calibrate(data, options);
  if (outcome.result && !outcome.result->moored && !options.noise.position_sigma &&
      outcome.result->position_sigma > largest_still_sigma) {
    options.noise.position_sigma = largest_still_sigma;
    outcome = calibrate(data, options);
  }
  return outcome;
}

PassInput forward_pass(const ImuData& data, const CalibrationResult& calibration) {
  PassInput input;
  input.data = &data;
  input.parameters = calibration.value;
  input.C_nb = calibration.C_nb_start;
  input.noise = calibration.noise;
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  return input;
}

}  // namespace selfcal::diagnosis
