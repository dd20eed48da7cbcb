// Recordings of the virtual INS as the estimator sees them.
#pragma once

#include "estimator/geometry/units.hpp"
#include "estimator/models/imu_data.hpp"
#include "estimator/models/sensor_model.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::test {

// The source's Table 5, three times its size.
inline sim::SimConfig thrice_table5() {
  sim::SimConfig config;
  config.parameter_set = "table5";
  const auto errors = *sim::true_sensor_errors(config, 0);
  for (std::size_t k = 0; k < errors.size(); ++k) {
    config.explicit_parameters[k] = 3.0 * errors[k] / sensor_parameters[k].si_per_unit;
  }
  return config;
}

// Sway of degrees, heave and surge of decimetres, 5 to 15 s: rougher than the reference recordings.
inline sim::BaseMotion rough_mooring() {
  using units::degree;
  sim::BaseMotion motion;
  motion.roll = {{3.0 * degree, 8.0, 0.0}};
  motion.pitch = {{2.0 * degree, 6.0, 1.0}};
  motion.yaw = {{1.0 * degree, 11.0, 2.0}};
  motion.heave = {{0.3, 9.0, 0.3}};
  motion.surge = {{0.3, 13.0, 1.3}};
  motion.sway = {{0.2, 10.0, 2.3}};
  return motion;
}

// `recording` must outlive the view.
inline ImuData view_of(const Recording& recording) {
  using units::degree;
  ImuData data;
  data.site = {recording.latitude_deg * degree, recording.longitude_deg * degree, recording.height_m};
  data.sample_rate_hz = recording.sample_rate_hz;
  data.time_s = recording.time_s;
  data.delta_theta = recording.delta_theta_rad;
  data.delta_v = recording.delta_v_mps;
  data.gimbal_outer = recording.gimbal_outer_rad;
  data.gimbal_inner = recording.gimbal_inner_rad;
  return data;
}

inline ParameterVector truth_of(const sim::SimConfig& config, std::uint64_t seed) {
  const sim::SensorErrors errors = *sim::true_sensor_errors(config, seed);
  return Eigen::Map<const ParameterVector>(errors.data());
}

}  // namespace selfcal::test
