// The estimate that runs along with the rotation, and its early end.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "daemon/run/calibration_run.hpp"

namespace selfcal {
namespace {

// From the rotation's clock, so that the gimbal still stands when the stop arrives: what the last status frame may be
// old, and a round trip on the operator's clock.
constexpr double status_age_s = 1.0;
constexpr double round_trip_s = 0.2;

// The last page's samples may be on their way into the FLASH.
constexpr double flash_lag_s = 1.0;

// The position (1 is the first) at which the gimbal stands at `elapsed_s` and for `margin_s` more; 0: at none.
int position_at(const Schedule& schedule, double elapsed_s, double margin_s) {
  double begin = 0.0;
  for (std::size_t i = 0; i < schedule.dwell_s.size(); ++i) {
    if (elapsed_s >= begin && elapsed_s + margin_s < begin + schedule.dwell_s[i]) {
      return static_cast<int>(i) + 1;
    }
    begin += schedule.dwell_s[i] + schedule.rotation_s;
  }
  return 0;
}

}  // namespace

void CalibrationRun::show_estimate(const ParameterVector& value, const ParameterVector& sigma) {
  progress_.estimate_known = true;
  progress_.tolerances_met = 0;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    progress_.value[i] = value(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
    progress_.sigma[i] = sigma(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
    if (progress_.sigma[i] <= progress_.tolerance[i]) {
      ++progress_.tolerances_met;
    }
  }
}

// Of what has arrived without a gap, whenever so much more has.
void CalibrationRun::estimate_meanwhile() {
  running_.pages_arrived(
      pages_->missing(progress_.pages_expected, 1).first, page_s_,
      [this] {
        return std::make_shared<RunningEstimator>(
            EstimateRequest{folder_, record_.rotation, record_.serial, record_.started_utc, schedule_, config_});
      },
      [this](const Expected<RunningEstimate>& answer, double data_s, bool first_met) {
        on_running_estimate(answer, data_s, first_met);
      });
}

void CalibrationRun::on_running_estimate(const Expected<RunningEstimate>& answer, double data_s, bool first_met) {
  if (!answer) {  // too little as yet; what is wrong with the data the final estimate will say
    remember("estimate", fmt::format("after {:.0f} s of data: no estimate yet: {}", data_s, answer.error().message));
    return;
  }
  progress_.running = true;
  progress_.data_s = answer->data_s;
  progress_.met_at_s = answer->forecast.met_at_s;
  show_estimate(answer->value, answer->sigma);
  foresee_finish();
  if (first_met) {
    remember("estimate",
             fmt::format("after {:.0f} s of data every parameter is determined to its tolerance", answer->data_s));
  }
  const auto& missing = answer->forecast.out_of_reach;
  // Early on the noise is known too badly to alarm anybody.
  if (!missing.empty() && !out_of_reach_said_ && record_.early_end_s < 0 &&
      answer->data_s > 0.25 * schedule_.duration_s()) {
    out_of_reach_said_ = true;
    warn(
        fmt::format("this schedule will not determine {} to tolerance in this installation", fmt::join(missing, ", ")));
  }
  report_progress(true);
}

// When the rotation ends, by its schedule or before.
void CalibrationRun::foresee_finish() {
  progress_.finish_in_s = -1.0;
  if (progress_.ins.state != ins::State::rotating) {
    return;
  }
  double left = progress_.ins.time_left_s;
  if (record_.stop_when_met && progress_.running && progress_.met_at_s >= 0) {
    const double elapsed = schedule_.duration_s() - left;
    left = std::min(left, std::max(0.0, progress_.met_at_s - elapsed));
  }
  progress_.finish_in_s = left / config_.time_scale;
}

// Where the gimbal stands at a position of the schedule, by its status frames. A gimbal that was never heard of is not
// stopped before its time.
bool CalibrationRun::may_end_early() const {
  if (!record_.stop_when_met || !running_.latest() || !running_.latest()->met) {
    return false;
  }
  const double heard_s = std::chrono::duration<double>(context_.timers.now() - status_at_).count();
  if (status_at_ == SteadyTime{} || heard_s > status_age_s || progress_.ins.moving) {
    return false;
  }
  const double elapsed = schedule_.duration_s() - progress_.ins.time_left_s;
  return position_at(schedule_, elapsed, status_age_s + (heard_s + round_trip_s) * config_.time_scale) > 0;
}

// Anybody may send a status frame: the INS is asked itself, for the position that it is at (result of the routine) and for the
// time that its data cover (directory), before its rotation is ended on such a frame's word.
Task<Answer<bool>> CalibrationRun::confirm_standing() {
  const double told_s = schedule_.duration_s() - progress_.ins.time_left_s;
  const SteadyTime heard_at = status_at_;
  const auto result = co_await client_.routine(uds::RoutineAction::result, ins::routine::self_calibration, {});
  if (!result) {
    co_return tl::unexpected(result.error());
  }
  const auto answered = ins::decode_run(*result);
  if (!answered) {
    co_return senseless(answered.error().message);
  }
  const auto directory = co_await read_checked_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  const double since_s = std::chrono::duration<double>(context_.timers.now() - heard_at).count() * config_.time_scale;
  const double data_s = static_cast<double>(directory->samples) / format_.sample_rate_hz;
  const bool time_fits = told_s <= data_s + page_s_ + flash_lag_s && told_s + since_s >= data_s - flash_lag_s;
  const bool ours = answered->state == ins::State::rotating && answered->run_id == record_.rotation;
  const int told_position = position_at(schedule_, told_s, 0.0);  // it may have gone on to the next one since
  const bool place_fits = answered->position == told_position || answered->position == told_position + 1;
  if (ours && time_fits && place_fits) {
    co_return position_at(schedule_, told_s + since_s, status_age_s + round_trip_s * config_.time_scale) > 0;
  }
  if (!std::exchange(contradiction_said_, true)) {
    remember("ins",
             fmt::format("status frames say that {:.1f} s of the rotation are over; the INS answers that it is {} at "
                         "position {} with {:.1f} s of data: it is not ended early on their word",
                         told_s, ins::name(answered->state), answered->position, data_s));
  }
  co_return false;
}

Task<CalibrationRun::Step> CalibrationRun::end_rotation_early() {
  if (record_.early_end_s < 0) {
    record_.early_end_s = running_.latest() ? running_.latest()->data_s : 0.0;  // until the last page tells
    remember("estimate", fmt::format("rotation ended early at position {} of {}, {:.0f} s before its time: every "
                                     "tolerance is met",
                                     progress_.ins.position, progress_.positions, progress_.ins.time_left_s));
  }
  if (auto rests = co_await bring_to_rest(); !rests) {
    co_return tl::unexpected(rests.error());
  }
  co_return Event::rotation_ended;
}

}  // namespace selfcal
