#include "daemon/estimate/calibrate_recording.hpp"

#include <chrono>

#include "estimator/geometry/units.hpp"
#include "estimator/planning/remedy.hpp"

namespace selfcal {

ImuData imu_view(const Recording& recording, std::vector<double>& first_temperature) {
  ImuData data;
  data.site = {recording.latitude_deg * units::degree, recording.longitude_deg * units::degree, recording.height_m};
  data.sample_rate_hz = recording.sample_rate_hz;
  data.time_s = recording.time_s;
  data.delta_theta = recording.delta_theta_rad;
  data.delta_v = recording.delta_v_mps;
  data.gimbal_outer = recording.gimbal_outer_rad;
  data.gimbal_inner = recording.gimbal_inner_rad;
  if (recording.temperature_channels == 1) {
    data.temperature = recording.temperature_c;
  } else if (recording.temperature_channels > 1) {
    first_temperature.resize(recording.size());
    for (std::size_t row = 0; row < recording.size(); ++row) {
      first_temperature[row] = recording.temperature_c[row * recording.temperature_channels];
    }
    data.temperature = first_temperature;
  }
  return data;
}

Expected<CalibrationResult> calibrate_recording(const Recording& recording, const CalibrationOptions& options,
                                                const std::function<void(const CalibrationProgress&)>& progress,
                                                const std::stop_token& stop, const diagnosis::SetAside* aside) {
  std::vector<double> first_temperature;
  const ImuData data = aside != nullptr ? aside->data() : imu_view(recording, first_temperature);
  const auto begin = std::chrono::steady_clock::now();
  CalibrationOutcome outcome = calibrate(data, options, progress, stop);
  if (!outcome.result) {
    return fail(ErrorKind::bad_input, std::move(outcome.failure.message));
  }
  CalibrationResult& result = *outcome.result;
  if (aside != nullptr) {
    result.left_out = aside->left_out();
  }
  add_remedies(result.undetermined, result.covariance, installation_of(result, data.site, options.tolerance));
  outcome.result->elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return std::move(*outcome.result);
}

}  // namespace selfcal
