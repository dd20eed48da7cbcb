#include "tests/blind/response.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"
#include "estimator/passes/calibration.hpp"
#include "estimator/passes/pass.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::blind {
namespace {

constexpr double still_base_sigma = 1e-6;  // m: the least that the calibration takes a still base for

// Attitude where the first sample starts: the gimbal read-out is free of noise in the configuration used here.
Matrix3 start_attitude(const sim::SimConfig& config, const Recording& recording) {
  return attitude_matrix(
             {config.roll_deg * units::degree, config.pitch_deg * units::degree, config.heading_deg * units::degree}) *
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

Expected<Filtered> Filtered::make(const sim::SimConfig& config, const Schedule& schedule, std::uint64_t seed) {
  Filtered f;
  f.quiet_ = config;
  f.quiet_.gyro_arw_deg_per_sqrt_h = 0.0;
  f.quiet_.accel_vrw_ug_per_sqrt_hz = 0.0;
  f.quiet_.gyro_lsb_arcsec = 1e-5;  // counts of 32 bits still hold 30 deg/s at 50 Hz
  f.quiet_.accel_lsb_m_per_s = 1e-9;
  f.quiet_.gimbal.readout_noise_arcsec = 0.0;
  f.schedule_ = schedule;
  f.seed_ = seed;
  const auto errors = sim::true_sensor_errors(config, seed);
  const auto recording = sim::simulate(f.quiet_, schedule, seed, {});
  if (!errors) {
    return tl::unexpected(errors.error());
  }
  if (!recording) {
    return tl::unexpected(recording.error());
  }
  f.truth_ = Eigen::Map<const ParameterVector>(errors->data());
  f.C_nb_ = start_attitude(config, *recording);
  f.assumed_ = config;
  f.without_ = pass_over(config, *recording, f.truth_, f.C_nb_);
  return f;
}

ParameterMatrix Filtered::covariance() const {
  const int at = without_.layout.parameters();
  return without_.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at);
}

Expected<Filtered::Difference> Filtered::difference(const sim::ConcealedPhysics& physics, double warm_up_s) const {
  if (physics.effects.empty() && physics.laws.empty()) {
    return Difference{Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(without_.epochs.size())),
                      ParameterVector::Zero()};
  }
  sim::SimConfig config = quiet_;
  if (warm_up_s > 0.0) {
    config.temperature.warm_up_tau_s = warm_up_s;
  }
  const auto recording = sim::simulate(config, schedule_, seed_, physics);
  if (!recording) {
    return tl::unexpected(recording.error());
  }
  const PassOutput with = pass_over(assumed_, *recording, truth_, C_nb_);
  const std::size_t epochs = std::min(with.epochs.size(), without_.epochs.size());
  Difference d;
  d.innovation.resize(3 * static_cast<Eigen::Index>(epochs));
  for (std::size_t k = 0; k < epochs; ++k) {
    d.innovation.segment<3>(3 * static_cast<Eigen::Index>(k)) =
        (with.epochs[k].innovation - without_.epochs[k].innovation)
            .cwiseQuotient(without_.epochs[k].variance.cwiseSqrt());
  }
  const int at = without_.layout.parameters();
  d.shift = with.mean.segment<sensor_parameter_count>(at) - without_.mean.segment<sensor_parameter_count>(at);
  return d;
}

Expected<Response> Filtered::response(const sim::ConcealedPhysics& physics) const {
  const auto d = difference(physics);
  if (!d) {
    return tl::unexpected(d.error());
  }
  return Response{d->innovation.norm(), d->shift, covariance().diagonal().cwiseSqrt()};
}

Expected<Filtered::Design> Filtered::design(const std::vector<Column>& columns) const {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Design design;
  design.S.resize(sensor_parameter_count, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Column& column = columns[static_cast<std::size_t>(k)];
    const auto plus = difference(column.plus, column.plus_warm_up_s);
    const auto minus = difference(column.minus, column.minus_warm_up_s);
    if (!plus || !minus) {
      return tl::unexpected(plus ? minus.error() : plus.error());
    }
    design.D.conservativeResize(plus->innovation.size(), n);
    design.D.col(k) = (plus->innovation - minus->innovation) / column.step;
    design.S.col(k) = (plus->shift - minus->shift) / column.step;
  }
  return design;
}

Expected<ParameterVector> Filtered::augmented_sigma(const std::vector<Column>& columns) const {
  const auto made = design(columns);
  if (!made) {
    return tl::unexpected(made.error());
  }
  Eigen::MatrixXd information = made->D.transpose() * made->D;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    information(at, at) += 1.0 / (columns[k].prior * columns[k].prior);
  }
  const ParameterMatrix augmented = covariance() + made->S * information.ldlt().solve(made->S.transpose());
  return ParameterVector(augmented.diagonal().cwiseSqrt());
}

Expected<double> Filtered::unlike(const sim::ConcealedPhysics& physics, const std::vector<Column>& columns) const {
  const auto concealed = difference(physics);
  const auto made = design(columns);
  if (!concealed || !made) {
    return tl::unexpected(concealed ? made.error() : concealed.error());
  }
  Eigen::MatrixXd information = made->D.transpose() * made->D;
  information.diagonal().array() += 1e-6;  // sizes up to 1000 of the columns' own
  const Eigen::VectorXd score = made->D.transpose() * concealed->innovation;
  return std::sqrt(std::max(0.0, concealed->innovation.squaredNorm() - score.dot(information.ldlt().solve(score))));
}

}  // namespace selfcal::blind
