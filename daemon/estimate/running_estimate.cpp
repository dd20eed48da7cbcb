#include "daemon/estimate/running_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/estimate_job.hpp"
#include "daemon/estimate/gate.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/planning/plan.hpp"

namespace selfcal {
namespace {

constexpr double forecast_step_s = 60.0;  // dwells longer than this are looked at in pieces
constexpr double out_of_reach_margin = 1.1;
constexpr double most_loss = 10.0;  // the data gave less than the analysis by this at most

// The same motion with longer dwells in pieces, a "move" to where the gimbal stands already between them.
Schedule in_pieces(const Schedule& schedule) {
  Schedule fine{{}, {}, schedule.rotation_s};
  for (std::size_t i = 0; i < schedule.positions.size(); ++i) {
    const double dwell = schedule.dwell_s[i];
    const int wanted = static_cast<int>(std::ceil(dwell / forecast_step_s));
    // Every piece keeps a second at least beside the moves that are none.
    const int longest = static_cast<int>((dwell + schedule.rotation_s) / (schedule.rotation_s + 1.0));
    const int count = std::max(1, std::min(wanted, longest));
    for (int k = 0; k < count; ++k) {
      fine.positions.push_back(schedule.positions[i]);
      fine.dwell_s.push_back((dwell - (count - 1) * schedule.rotation_s) / count);
    }
  }
  return fine;
}

// How much less the data gave than the analysis says, over all parameters: the median, because single ones that are
// hardly seen yet hang on a degree of the gimbal's error and differ by any factor.
double common_loss(const ParameterVector& found, const ParameterVector& planned) {
  ParameterVector ratio = found.cwiseQuotient(planned);
  double* middle = ratio.data() + ratio.size() / 2;
  std::nth_element(ratio.data(), middle, ratio.data() + ratio.size());
  return std::clamp(*middle, 1.0, most_loss);
}

}  // namespace

Forecast forecast(const Schedule& schedule, const CalibrationResult& so_far, const earth::Position& site, double data_s,
                  const ParameterVector& tolerance) {
  Installation installation;
  installation.attitude = so_far.initial_attitude;
  installation.site = site;
  installation.gyro_arw = so_far.gyro_arw;
  installation.accel_vrw = so_far.accel_vrw;
  installation.position_sigma = so_far.position_sigma;
  installation.tolerance.setConstant(HUGE_VAL);  // what is missing, and how to get it, is not asked here
  const Plan planned_so_far = predict(schedule_until(schedule, data_s), installation);
  const double loss = common_loss(so_far.sigma, planned_so_far.sigma);
  const Plan whole = predict(in_pieces(schedule), installation);

  Forecast answer;
  ParameterVector last = so_far.sigma;
  for (const PositionForecast& point : whole.history) {
    if (point.end_s <= data_s) {
      continue;
    }
    last = loss * point.sigma;
    const bool met = (last.array() <= early_end_margin * tolerance.array()).all();
    if (met && answer.met_at_s < 0) {
      answer.met_at_s = point.end_s;
    }
  }
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    // More data do not make a sigma larger, and the forecast of one is good to a tenth.
    if (so_far.sigma(k) > tolerance(k) && last(k) > out_of_reach_margin * tolerance(k)) {
      answer.out_of_reach.emplace_back(sensor_parameters[i].name);
    }
  }
  return answer;
}

Expected<RunningEstimate> RunningEstimator::estimate(std::uint32_t pages, const std::stop_token& stop) {
  if (!recording_) {
    auto begun = PageRecording::begin(request_);
    if (!begun) {
      return tl::unexpected(begun.error());
    }
    recording_ = std::move(*begun);
  }
  if (auto taken = recording_->take(pages); !taken) {
    return tl::unexpected(taken.error());
  }
  const CalibrationOptions options = calibration_options(request_.config);
  const Recording& recording = recording_->recording();
  const auto result = calibrate_recording(recording, options, {}, stop);
  if (!result) {
    return tl::unexpected(result.error());
  }
  RunningEstimate answer;
  answer.data_s = recording_->duration_s();
  answer.value = result->value;
  answer.sigma = result->sigma;
  answer.tolerance = options.tolerance;
  answer.objections = judge(*result, options.tolerance, request_.config.limit).words();
  answer.met =
      answer.objections.empty() && (result->sigma.array() <= early_end_margin * options.tolerance.array()).all();
  const earth::Position site{recording.latitude_deg * units::degree, recording.longitude_deg * units::degree,
                             recording.height_m};
  answer.forecast = answer.met ? Forecast{answer.data_s, {}}
                               : forecast(request_.schedule, *result, site, answer.data_s, options.tolerance);
  return answer;
}

RunningJob running_job(std::shared_ptr<RunningEstimator> estimator, std::uint32_t pages) {
  return [estimator = std::move(estimator), pages](const std::stop_token& stop) {
    return estimator->estimate(pages, stop);
  };
}

}  // namespace selfcal
