#include "estimator/passes/calibration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/models/sensor_noise.hpp"
#include "estimator/navigation/coarse_alignment.hpp"
#include "estimator/passes/consistency.hpp"
#include "estimator/passes/motion_fit.hpp"
#include "estimator/passes/noise_fit.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal {
namespace {

constexpr double interval_s = 1.0;
constexpr double least_duration_s = 60.0;
// Until the site's own noise is known. Moored: decimetres.
constexpr double first_still_sigma = 3e-6;     // m
constexpr double first_moored_sigma = 0.2;     // m
constexpr double least_position_sigma = 1e-6;  // m: a still base stands to micrometres
constexpr int motion_rounds = 2;
constexpr double fair_nis = 10.0;  // beyond it another heading is tried
// Whatever is left out makes innovations larger than predicted. Where they are far smaller the densities were taken too
// large: lines and a coarse quantum beside little white noise do that to a spectrum.
constexpr double far_below_one = 0.5;

ParameterVector groups(double accel_bias, double gyro_drift, double accel_scale, double accel_angle, double gyro_scale,
                       double gyro_angle) {
  ParameterVector v;
  v.segment<3>(parameter::accel_bias).setConstant(accel_bias);
  v.segment<3>(parameter::gyro_drift).setConstant(gyro_drift);
  v.segment<6>(parameter::accel_scale_pos).setConstant(accel_scale);
  v.segment<3>(parameter::accel_misalignment).setConstant(accel_angle);
  v.segment<3>(parameter::gyro_scale).setConstant(gyro_scale);
  v.segment<6>(parameter::gyro_misalignment).setConstant(gyro_angle);
  return v;
}

// NIS per degree of freedom from the median of the epochs: a few seconds disturbed from outside do not count.
double typical_nis(const PassOutput& pass) {
  constexpr double median_of_chi_squared_3 = 2.366;
  std::vector<double> squares;
  for (const Epoch& e : pass.epochs) {
    squares.push_back(e.innovation.cwiseAbs2().cwiseQuotient(e.variance).sum());
  }
  if (squares.empty()) {
    return 1.0;
  }
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return *middle / median_of_chi_squared_3;
}

// What the passes hand on to each other, and the answer so far.
class Calibration {
 public:
  Calibration(const ImuData& data, const CalibrationOptions& options,
              const std::function<void(const CalibrationProgress&)>& progress, const std::stop_token& stop)
      : data_(data),
        coasts_(data.coasts.begin(), data.coasts.end()),
        options_(options),
        progress_(progress),
        stop_(stop),
        segments_(find_segments(data)) {
    data_.coasts = coasts_;
    noise_ = estimate_sensor_noise(data_, observed(segments_, data_));
    if (noise_.base_moves) {  // what the gyros did not see of it is open
      for (Coast& coast : coasts_) {
        coast.turned = coast.gyros;
      }
    }
    input_.data = &data_;
    input_.turns_are_constants = !options.carried_covariance;
    input_.interval_s = interval_s;
    input_.prior.parameter_sigma = 2.0 * plausible_limit();
    input_.noise.gyro_arw = options.noise.gyro_arw.value_or(noise_.gyro.white_asd);
    input_.noise.accel_vrw = options.noise.accel_vrw.value_or(noise_.accel.white_asd);
    input_.noise.observation.sigma =
        options.noise.position_sigma.value_or(noise_.base_moves ? first_moored_sigma : first_still_sigma);
  }

  Calibration(const Calibration&) = delete;
  Calibration& operator=(const Calibration&) = delete;

  CalibrationOutcome run();

 private:
  bool align();
  bool pass(double sign);
  bool settle(int least_passes);
  void freeze_open_directions();
  bool settle_at_last();
  bool fit_position_sigma();
  bool fit_base_motion();
  bool spectra_mislead() const;
  void fit_noise();
  ParameterVector sigma_of_whole();
  CalibrationResult result();
  ParameterVector sigma() const {
    return last_.covariance.diagonal().segment<sensor_parameter_count>(last_.layout.parameters()).cwiseSqrt();
  }

  ImuData data_;
  std::vector<Coast> coasts_;  // its own, with the turns as the passes find them
  const CalibrationOptions& options_;
  const std::function<void(const CalibrationProgress&)>& progress_;
  const std::stop_token& stop_;
  std::vector<Segment> segments_;
  SensorNoise noise_;
  PassInput input_;
  PassOutput last_;
  ParameterVector value_ = ParameterVector::Zero();  // the answer of the last pass
  bool freeze_open_ = false;
  double next_sign_ = 1.0;
  std::vector<PassSummary> passes_;
  std::array<std::optional<ParameterVector>, 2> answers_;  // of the last forward and the last reverse pass
  double last_move_ = 0.0;                                 // in sigma, since the pass before
  double same_way_move_ = 0.0;                             // in sigma, since the last pass of the same direction
  bool converged_ = false;
  bool noise_of_drift_ = false;
};

// One pass from where the last one ended; the next will go the other way.
bool Calibration::pass(double sign) {
  input_.sign = sign;
  const auto direction = sign > 0.0 ? PassDirection::forward : PassDirection::reverse;
  const int number = static_cast<int>(passes_.size()) + 1;
  PassProgress report;
  if (progress_) {
    report = [&](double fraction, const ParameterVector& value, const ParameterVector& s) {
      progress_({number, direction, fraction, value, s});
    };
  }
  last_ = run_pass(input_, report, stop_);
  if (last_.stopped) {
    return false;
  }
  const ParameterVector value =
      input_.parameters + last_.mean.segment<sensor_parameter_count>(last_.layout.parameters());
  for (std::size_t k = 0; k < coasts_.size(); ++k) {
    coasts_[k].turn = last_.turns[k];
  }
  last_move_ = (value - value_).cwiseAbs().cwiseQuotient(sigma()).maxCoeff();
  std::optional<ParameterVector>& same_way = answers_[sign > 0.0 ? 0 : 1];
  same_way_move_ = same_way ? (value - *same_way).cwiseAbs().cwiseQuotient(sigma()).maxCoeff() : HUGE_VAL;
  same_way = value;
  passes_.push_back({direction, static_cast<double>(data_.size()) / data_.sample_rate_hz, last_.nis_mean, last_move_,
                     last_.history_s, last_.history_value, last_.history_sigma});
  value_ = value;
  input_.parameters = value;
  input_.C_nb = last_.C_nb;
  if (freeze_open_) {
    freeze_open_directions();
  }
  next_sign_ = -sign;
  if (options_.carried_covariance) {
    const int at = last_.layout.parameters();
    input_.prior.carried = last_.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at).eval();
  }
  return true;
}

// Coarse alignment and the first pass. Where the first pass makes no sense the heading was wrong (a poor view of
// Earth's rotation): the other quadrants are tried, and the best kept.
bool Calibration::align() {
  const bool dwells = !segments_.empty() && !segments_[0].rotation;
  const double duration = data_.time_s.back() - data_.time_s.front();
  const double first_dwell = dwells ? segments_[0].end_s - segments_[0].start_s : 0.0;
  const Matrix3 C_coarse = coarse_alignment(data_, std::min(duration, std::max(first_dwell, least_duration_s))).C_nb;
  double best_nis = 0.0;
  Matrix3 C_best = C_coarse;
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const Matrix3 C_try = rotation_y(0.5 * M_PI * quadrant) * C_coarse;
    input_.C_nb = C_try;
    input_.parameters.setZero();
    value_.setZero();
    passes_.clear();
    if (!pass(+1.0)) {
      return false;
    }
    if (quadrant == 0 || last_.nis_mean < best_nis) {
      best_nis = last_.nis_mean;
      C_best = C_try;
    }
    if (last_.nis_mean < fair_nis) {
      return true;
    }
  }
  input_.C_nb = C_best;
  input_.parameters.setZero();
  value_.setZero();
  passes_.clear();
  return pass(+1.0);
}

// Passes until the parameters stand still.
bool Calibration::settle(int least_passes) {
  converged_ = false;
  for (int count = 0; count < options_.max_passes; ++count) {
    if (!pass(next_sign_)) {
      return false;
    }
    // Still against the pass before, which ran the other way, or against the one before that, which ran the same way:
    // with a fitted motion of the base the two ways do not weigh the ends alike.
    const double move = std::min(last_move_, same_way_move_);
    if (static_cast<int>(passes_.size()) >= least_passes && move < options_.convergence_sigma) {
      converged_ = true;
      break;
    }
  }
  return true;
}

// Linearises the next pass where the parameters that the data leave open are zero, and the attitude what it would then be:
// beyond first order nothing is known along such directions, and an iteration walks along them for ever. The answer
// holds them all the same, to first order, as far as the prior lets them.
void Calibration::freeze_open_directions() {
  const int at = last_.layout.parameters();
  const ParameterMatrix P = last_.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at);
  const ParameterVector& scale = options_.tolerance;
  const Eigen::SelfAdjointEigenSolver<ParameterMatrix> eigen(scale.cwiseInverse().asDiagonal() * P *
                                                             scale.cwiseInverse().asDiagonal());
  ParameterVector held = ParameterVector::Zero();
  for (int k = 0; k < sensor_parameter_count; ++k) {
    if (eigen.eigenvalues()(k) <= 1.0) {
      const ParameterVector direction = eigen.eigenvectors().col(k);
      held += direction * direction.dot(value_.cwiseQuotient(scale));
    }
  }
  held = held.cwiseProduct(scale);
  const Eigen::Matrix<double, 3, sensor_parameter_count> cross =
      last_.covariance.block<3, sensor_parameter_count>(StateLayout::attitude, at);
  const Vector3 phi = cross * P.ldlt().solve(held - value_);
  input_.C_nb = matrix_from_rotation_vector(phi) * last_.C_nb;
  input_.parameters = held;
}

// Where the passes do not settle, what the data leave open is held.
bool Calibration::settle_at_last() {
  constexpr int least_passes = 3;
  if (!settle(least_passes)) {
    return false;
  }
  if (converged_) {
    return true;
  }
  freeze_open_ = true;
  freeze_open_directions();
  return settle(least_passes);
}

// A still base: the white position noise is the one with the greatest likelihood, from 1 um upwards by factors of 3;
// where it lies above that, to a seventh (3^(1/8) either way).
bool Calibration::fit_position_sigma() {
  PassOutput best = last_;
  double best_sigma = input_.noise.observation.sigma;
  const auto attempt = [&](double candidate) {
    PassInput trial = input_;
    trial.sign = next_sign_;
    trial.noise.observation.sigma = candidate;
    const PassOutput out = run_pass(trial, {}, stop_);
    const bool better = !out.stopped && out.log_likelihood > best.log_likelihood;
    if (better) {
      best = out;
      best_sigma = candidate;
    }
    return better;
  };
  // Innovations stronger than predicted ask for more noise, weaker ones for less.
  const double factor = last_.nis_mean > 1.0 ? 3.0 : 1.0 / 3.0;
  for (double s = factor * best_sigma; s < 1.0 && s > 0.9 * least_position_sigma && attempt(s); s *= factor) {
  }
  if (best_sigma > 1.5 * least_position_sigma) {
    for (const double step : {std::pow(3.0, 0.5), std::pow(3.0, 0.25)}) {
      attempt(best_sigma * step) || attempt(best_sigma / step);
    }
  }
  input_.noise.observation.sigma = std::max(best_sigma, least_position_sigma);
  return !stop_.stop_requested();
}

// A moored base: its motion is fitted to the drift of the navigation with the parameters found so far, and again once
// they are better: what they leave wrong sways with the base and passes for motion.
bool Calibration::fit_base_motion() {
  for (int round = 0; round < motion_rounds; ++round) {
    if (round > 0 && !pass(next_sign_)) {
      return false;
    }
    PassInput trial = input_;
    trial.sign = next_sign_;
    input_.noise.observation =
        fit_motion(drift_series(trial), {input_.noise.accel_vrw, input_.noise.gyro_arw, first_still_sigma});
  }
  return !stop_.stop_requested();
}

bool Calibration::spectra_mislead() const {
  const NoiseOptions& given = options_.noise;
  return options_.noise_of_drift && !noise_.base_moves && !given.gyro_arw && !given.accel_vrw &&
         !given.position_sigma && typical_nis(last_) < far_below_one;
}

// All densities from the drift of the navigation, with the walk that a coarse quantum makes of the position.
void Calibration::fit_noise() {
  PassInput trial = input_;
  trial.sign = next_sign_;
  const double scale = std::sqrt(typical_nis(last_));
  const double walk = noise_.accel.quantum / std::sqrt(12.0 * data_.sample_rate_hz);  // one rounding a sample
  const StillNoiseFit fit = fit_still_noise(
      drift_series(trial), {scale * input_.noise.gyro_arw, scale * input_.noise.accel_vrw, first_still_sigma,
                            Vector3::Constant(std::max(walk, least_position_sigma))});
  input_.noise.gyro_arw = fit.noise.gyro_arw;
  input_.noise.accel_vrw = fit.noise.accel_vrw;
  input_.noise.observation.sigma = std::max(fit.noise.position_sigma, least_position_sigma);
  for (int axis = 0; axis < 3; ++axis) {
    input_.noise.observation.motion[static_cast<std::size_t>(axis)] = position_walk(fit.noise.position_walk(axis));
  }
  input_.noise.disturbed = fit.disturbed;
  input_.force = ForceSource::gravity;
  noise_of_drift_ = true;
}

CalibrationOutcome Calibration::run() {
  CalibrationOutcome stopped{std::nullopt, {"stopped"}};
  if (!align()) {
    return stopped;
  }
  // Innovations tell of the site's noise only where the linearisation no longer shows in them.
  do {
    if (!pass(next_sign_)) {
      return stopped;
    }
  } while (last_move_ > 1.0 && static_cast<int>(passes_.size()) < 6);
  if (spectra_mislead()) {
    fit_noise();
  } else if (!options_.noise.position_sigma) {
    if (noise_.base_moves ? !fit_base_motion() : !fit_position_sigma()) {
      return stopped;
    }
  }
  if (!settle_at_last()) {
    return stopped;
  }
  if (next_sign_ < 0.0 && !pass(next_sign_)) {  // end at the start: its attitude is part of the answer
    return stopped;
  }
  return {result(), {}};
}

// The covariance needs the motion and no observation: the samples in the stretches left out move as the IMU did.
ParameterVector Calibration::sigma_of_whole() {
  if (coasts_.empty()) {
    return sigma();
  }
  ImuData whole = data_;
  whole.coasts = {};
  PassInput input = input_;
  input.data = &whole;
  input.sign = next_sign_;
  const PassOutput out = run_pass(input, {}, stop_);
  return out.stopped
             ? sigma()
             : ParameterVector(
                   out.covariance.diagonal().segment<sensor_parameter_count>(out.layout.parameters()).cwiseSqrt());
}

CalibrationResult Calibration::result() {
  CalibrationResult r;
  r.value = value_;
  r.sigma = sigma();
  const int at = last_.layout.parameters();
  r.covariance = last_.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at);
  judge_parameters(r, options_.tolerance);
  r.gyro_arw = input_.noise.gyro_arw;
  r.accel_vrw = input_.noise.accel_vrw;
  r.position_sigma = input_.noise.observation.sigma;
  r.noise = input_.noise;
  r.gyro_arw_sigma = noise_.gyro.white_sigma;
  r.gyro_quantum = noise_.gyro.quantum;
  r.accel_quantum = noise_.accel.quantum;
  r.moored = noise_.base_moves && input_.noise.observation.state_count() > 0;
  r.noise_given = options_.noise.gyro_arw || options_.noise.accel_vrw || options_.noise.position_sigma;
  r.noise_of_drift = noise_of_drift_;
  r.consistency = judge_innovations(last_, converged_, last_move_, r.noise_given);
  r.segments = summarise_segments(segments_, last_);

  r.C_nb_start = last_.C_nb;
  r.linearised_value = input_.parameters;
  r.linearised_C_nb = input_.C_nb;
  r.held = freeze_open_;
  r.attitude_sigma = last_.covariance.diagonal().segment<3>(StateLayout::attitude).cwiseSqrt();
  const bool gimbal = !data_.gimbal_outer.empty() && !data_.gimbal_inner.empty();
  const Matrix3 C_vb = gimbal ? gimbal_matrix(data_.gimbal_outer[0], data_.gimbal_inner[0]) : Matrix3::Identity();
  r.initial_attitude = attitude_from_matrix(r.C_nb_start * C_vb.transpose());
  r.coasts = coasts_;
  r.sigma_whole = sigma_of_whole();
  r.passes = std::move(passes_);
  return r;
}

}  // namespace

ParameterVector default_tolerance() {
  return groups(10.0 * units::micro_g, 0.005 * units::degree_per_hour, 10.0 * units::ppm, 5.0 * units::arcsecond,
                10.0 * units::ppm, 5.0 * units::arcsecond);
}

ParameterVector plausible_limit() {
  return groups(1e4 * units::micro_g, 2.0 * units::degree_per_hour, 5000.0 * units::ppm, units::degree,
                5000.0 * units::ppm, units::degree);
}

CalibrationOutcome calibrate(const ImuData& data, const CalibrationOptions& options,
                             const std::function<void(const CalibrationProgress&)>& progress,
                             const std::stop_token& stop) {
  if (data.size() < 2 || data.time_s.back() - data.time_s.front() < least_duration_s) {
    return {std::nullopt, {"the recording is shorter than 60 s: too short to align"}};
  }
  Calibration calibration(data, options, progress, stop);
  return calibration.run();
}

}  // namespace selfcal
