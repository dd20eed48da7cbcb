#include "tests/blind/response.hpp"

#include <cmath>

#include "estimator/geometry/units.hpp"
#include "estimator/passes/calibration.hpp"
#include "estimator/passes/pass.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::blind {
namespace {

constexpr double still_base_sigma = 1e-6;   // m: the least that the calibration takes a still base for

// Attitude where the first sample starts: the gimbal read-out is free of noise in the configuration used here.
Matrix3 start_attitude(const sim::SimConfig& config, const Recording& recording) {
  return attitude_matrix({config.roll_deg * units::degree, config.pitch_deg * units::degree,
                           config.heading_deg * units::degree}) *
         gimbal_matrix(recording.gimbal_outer_rad.front(), recording.gimbal_inner_rad.front());
}

PassOutput pass_over(const sim::SimConfig& config, const Recording& recording, const ParameterVector& truth,
                     const Matrix3& C_nb) {
  ImuData data;
  data.site = {recording.latitude_deg * units::degree, recording.longitude_deg * units::degree, recording.height_m};
  data.sample_rate_hz = recording.sample_rate_hz;
  data.time_s = recording.time_s;
  data.delta_theta = recording.delta_theta_rad;
  data.delta_v = recording.delta_v_mps;
  PassInput input;
  input.data = &data;
  input.parameters = truth;
  input.C_nb = C_nb;
  input.noise.gyro_arw = config.gyro_arw_deg_per_sqrt_h * units::degree_per_sqrt_hour;
  input.noise.accel_vrw = config.accel_vrw_ug_per_sqrt_hz * units::micro_g_per_sqrt_hz;
  input.noise.observation.sigma = still_base_sigma;
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  return run_pass(input);
}

}  // namespace

Expected<Response> response_to(const sim::SimConfig& config, const Schedule& schedule, std::uint64_t seed,
                               const sim::ConcealedPhysics& physics) {
  sim::SimConfig quiet = config;
  quiet.gyro_arw_deg_per_sqrt_h = 0.0;
  quiet.accel_vrw_ug_per_sqrt_hz = 0.0;
  quiet.gyro_lsb_arcsec = 1e-5;       // counts of 32 bits still hold 30 deg/s at 50 Hz
  quiet.accel_lsb_m_per_s = 1e-9;
  quiet.gimbal.readout_noise_arcsec = 0.0;
  const auto errors = sim::true_sensor_errors(config, seed);
  const auto without = sim::simulate(quiet, schedule, seed, {});
  const auto with = sim::simulate(quiet, schedule, seed, physics);
  for (const auto* made : {&without, &with}) {
    if (!*made) {
      return tl::unexpected(made->error());
    }
  }
  if (!errors) {
    return tl::unexpected(errors.error());
  }
  const ParameterVector truth = Eigen::Map<const ParameterVector>(errors->data());
  const Matrix3 C_nb = start_attitude(config, *without);
  const PassOutput a = pass_over(config, *without, truth, C_nb);
  const PassOutput b = pass_over(config, *with, truth, C_nb);
  Response r;
  double square = 0.0;
  for (std::size_t k = 0; k < a.epochs.size() && k < b.epochs.size(); ++k) {
    const Vector3 d = b.epochs[k].innovation - a.epochs[k].innovation;
    square += d.cwiseAbs2().cwiseQuotient(a.epochs[k].variance).sum();
  }
  r.sigmas = std::sqrt(square);
  const int at = a.layout.parameters();
  r.shift = b.mean.segment<sensor_parameter_count>(at) - a.mean.segment<sensor_parameter_count>(at);
  r.sigma = a.covariance.diagonal().segment<sensor_parameter_count>(at).cwiseSqrt();
  return r;
}

}  // namespace selfcal::blind
