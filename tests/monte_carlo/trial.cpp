#include "tests/monte_carlo/trial.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "daemon/estimate/calibrate_recording.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/planning/plan.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::monte_carlo {
namespace {

struct TrueNoise {
  double gyro_arw, accel_vrw;
  double position_sigma;  // of a still base
};

// A still base does not move at all; what is left is the velocity quantum, carried on: lsb/sqrt(12) in velocity at
// both ends of the 1 s interval.
TrueNoise true_noise(const sim::SimConfig& config) {
  return {config.gyro_arw_deg_per_sqrt_h * units::degree_per_sqrt_hour,
          config.accel_vrw_ug_per_sqrt_hz * units::micro_g_per_sqrt_hz, config.accel_lsb_m_per_s / std::sqrt(12.0)};
}

// The Cramer-Rao bound of this run: covariance of one least squares about the true parameters with the true noise.
// On a moored base the observation model is the one in use.
ParameterVector bound(const ImuData& data, const ParameterVector& truth, const TrueNoise& noise,
                      const CalibrationResult& result) {
  PassInput input;
  input.data = &data;
  input.parameters = truth;
  input.C_nb = result.C_nb_start;  // only where the model is linearised
  input.noise.gyro_arw = noise.gyro_arw;
  input.noise.accel_vrw = noise.accel_vrw;
  input.noise.observation.sigma = noise.position_sigma;
  if (result.moored) {
    input.noise.observation = result.noise.observation;
  }
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  const PassOutput out = run_pass(input);
  return out.covariance.diagonal().segment<sensor_parameter_count>(out.layout.parameters()).cwiseSqrt();
}

ParameterVector plan_sigma(const sim::SimConfig& config, const Schedule& schedule, const TrueNoise& noise) {
  Installation place;
  place.attitude = {config.roll_deg * units::degree, config.pitch_deg * units::degree,
                    config.heading_deg * units::degree};
  place.site = {config.latitude_deg * units::degree, config.longitude_deg * units::degree, config.height_m};
  place.gyro_arw = noise.gyro_arw;
  place.accel_vrw = noise.accel_vrw;
  place.position_sigma = noise.position_sigma;
  return predict(schedule, place).sigma;
}

Nees normalised(const ParameterVector& error, const ParameterMatrix& covariance) {
  const ParameterVector unit = default_tolerance();
  const ParameterMatrix scaled = unit.cwiseInverse().asDiagonal() * covariance * unit.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<ParameterMatrix> eigen(scaled);
  const ParameterVector along = eigen.eigenvectors().transpose() * error.cwiseQuotient(unit);
  Nees nees;
  for (int k = 0; k < sensor_parameter_count && eigen.eigenvalues()(k) <= 1.0; ++k) {
    nees.sum += along(k) * along(k) / eigen.eigenvalues()(k);
    ++nees.degrees;
  }
  return nees;
}

Nees control(const ImuData& data, const ParameterVector& truth, const TrueNoise& noise, Control which) {
  CalibrationOptions options;
  if (which == Control::carried) {
    options.carried_covariance = true;
  } else {
    const double factor = which == Control::noise_doubled ? 2.0 : 0.5;
    options.noise.gyro_arw = factor * noise.gyro_arw;
    options.noise.accel_vrw = factor * noise.accel_vrw;
  }
  const CalibrationOutcome outcome = calibrate(data, options);
  return outcome.result ? normalised(outcome.result->value - truth, outcome.result->covariance) : Nees{};
}

void compare(const CalibrationResult& r, const ParameterVector& truth, Trial& trial) {
  const ParameterVector error = r.value - truth;
  trial.nees = normalised(error, r.covariance);
  const Vector3 drift = error.segment<3>(parameter::gyro_drift);
  const Matrix3 P = r.covariance.block<3, 3>(parameter::gyro_drift, parameter::gyro_drift);
  trial.gyro_drift = {drift.dot(P.ldlt().solve(drift)), 3};
  trial.verdict = r.consistency.verdict;
  trial.passes = static_cast<int>(r.passes.size());
  trial.nis = r.consistency.nis_mean;
}

}  // namespace

Trial run_trial(const Case& c, double sample_rate_hz, std::uint64_t seed, bool with_controls) {
  Trial trial;
  trial.seed = seed;
  const sim::SimConfig config = configuration(c, sample_rate_hz, seed);
  const Schedule schedule = schedule_of(c);
  const auto recording = sim::simulate(config, schedule, seed, {});
  const auto errors = sim::true_sensor_errors(config, seed);
  if (!recording || !errors) {
    trial.failure = recording ? errors.error().message : recording.error().message;
    return trial;
  }
  std::vector<double> temperature;
  const ImuData data = imu_view(*recording, temperature);
  const ParameterVector truth = Eigen::Map<const ParameterVector>(errors->data());
  const CalibrationOutcome outcome = calibrate(data, {});
  if (!outcome.result) {
    trial.failure = outcome.failure.message;
    return trial;
  }
  const CalibrationResult& r = *outcome.result;
  const TrueNoise noise = true_noise(config);
  compare(r, truth, trial);
  const ParameterVector limit = bound(data, truth, noise, r);
  trial.error_bound = (r.value - truth).cwiseQuotient(limit);
  trial.error_plan = (r.value - truth).cwiseQuotient(plan_sigma(config, schedule, noise));
  trial.own_bound = r.sigma.cwiseQuotient(limit);
  trial.arw_ratio = r.gyro_arw / noise.gyro_arw;
  trial.vrw_ratio = r.accel_vrw / noise.accel_vrw;
  for (std::size_t k = 0; with_controls && k < trial.controls.size(); ++k) {
    trial.controls[k] = control(data, truth, noise, static_cast<Control>(k));
  }
  return trial;
}

}  // namespace selfcal::monte_carlo
