#include "daemon/run/running_steps.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

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

RunningSteps::RunningSteps(const StepContext& context, Estimators& estimators, RawData& raw)
    : RunSteps(context), raw_(raw), running_(context.timers, estimators, context.data.config.running_estimate_s) {}

// Of what has arrived without a gap, whenever so much more has.
void RunningSteps::estimate_meanwhile() {
  running_.pages_arrived(
      raw_.without_gap(), raw_.page_s(),
      [this] {
        return std::make_shared<RunningEstimator>(EstimateRequest{data_.folder, journal_.record.rotation,
                                                                  journal_.record.serial, journal_.record.started_utc,
                                                                  data_.schedule, data_.config});
      },
      [this](const Expected<RunningEstimate>& answer, double data_s, bool first_met) {
        on_running_estimate(answer, data_s, first_met);
      });
}

void RunningSteps::on_running_estimate(const Expected<RunningEstimate>& answer, double data_s, bool first_met) {
  if (!answer) {  // too little as yet; what is wrong with the data the final estimate will say
    journal_.remember("estimate",
                      fmt::format("after {:.0f} s of data: no estimate yet: {}", data_s, answer.error().message));
    return;
  }
  journal_.progress.running = true;
  journal_.progress.data_s = answer->data_s;
  journal_.progress.met_at_s = answer->forecast.met_at_s;
  journal_.show_estimate(answer->value, answer->sigma);
  foresee_finish();
  if (first_met) {
    journal_.remember("estimate", fmt::format("after {:.0f} s of data every parameter is determined to its tolerance",
                                              answer->data_s));
  }
  const auto& missing = answer->forecast.out_of_reach;
  // Early on the noise is known too badly to alarm anybody.
  if (!missing.empty() && !out_of_reach_said_ && journal_.record.early_end_s < 0 &&
      answer->data_s > 0.25 * data_.schedule.duration_s()) {
    out_of_reach_said_ = true;
    journal_.warn(
        fmt::format("this schedule will not determine {} to tolerance in this installation", fmt::join(missing, ", ")));
  }
  journal_.report_progress(true);
}

// When the rotation ends, by its schedule or before.
void RunningSteps::foresee_finish() {
  journal_.progress.finish_in_s = -1.0;
  if (journal_.progress.ins.state != ins::State::rotating) {
    return;
  }
  double left = journal_.progress.ins.time_left_s;
  if (journal_.record.stop_when_met && journal_.progress.running && journal_.progress.met_at_s >= 0) {
    const double elapsed = data_.schedule.duration_s() - left;
    left = std::min(left, std::max(0.0, journal_.progress.met_at_s - elapsed));
  }
  journal_.progress.finish_in_s = left / data_.config.time_scale;
}

// Where the gimbal stands at a position of the schedule, by its status frames. A gimbal that was never heard of is not
// stopped before its time.
bool RunningSteps::may_end_early() const {
  if (!journal_.record.stop_when_met || !running_.latest() || !running_.latest()->met) {
    return false;
  }
  const double heard_s = std::chrono::duration<double>(timers_.now() - data_.status_at).count();
  if (data_.status_at == SteadyTime{} || heard_s > status_age_s || journal_.progress.ins.moving) {
    return false;
  }
  const double elapsed = data_.schedule.duration_s() - journal_.progress.ins.time_left_s;
  return position_at(data_.schedule, elapsed, status_age_s + (heard_s + round_trip_s) * data_.config.time_scale) > 0;
}

// Anybody may send a status frame: the INS is asked itself, for the position that it is at (result of the routine) and for the
// time that its data cover (directory), before its rotation is ended on such a frame's word. Where each move is commanded from here
// the port itself says how far the schedule is, by the INS's answers, and the data cover the time that the moves took.
Task<Answer<bool>> RunningSteps::confirm_standing() {
  const double told_s = data_.schedule.duration_s() - journal_.progress.ins.time_left_s;
  const SteadyTime heard_at = data_.status_at;
  const auto answered = co_await client_.rotation_result();
  if (!answered) {
    co_return tl::unexpected(answered.error());
  }
  const auto directory = co_await raw_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  const double since_s = std::chrono::duration<double>(timers_.now() - heard_at).count() * data_.config.time_scale;
  const double data_s = static_cast<double>(directory->samples) / data_.format.sample_rate_hz;
  const profile::Profile& speaks = *data_.config.profile;
  const bool by_moves = speaks.move.has_value() || speaks.frames.has_value();
  const bool time_fits =
      by_moves || (told_s <= data_s + raw_.page_s() + flash_lag_s && told_s + since_s >= data_s - flash_lag_s);
  const bool ours = answered->state == ins::State::rotating && answered->run_id == journal_.record.rotation;
  const int told_position = position_at(data_.schedule, told_s, 0.0);  // it may have gone on to the next one since
  const bool place_fits = answered->position == told_position || answered->position == told_position + 1;
  if (ours && time_fits && place_fits) {
    co_return position_at(data_.schedule, told_s + since_s, status_age_s + round_trip_s * data_.config.time_scale) > 0;
  }
  if (!std::exchange(contradiction_said_, true)) {
    journal_.remember(
        "ins", fmt::format("status frames say that {:.1f} s of the rotation are over; the INS answers that it is {} at "
                           "position {} with {:.1f} s of data: it is not ended early on their word",
                           told_s, ins::name(answered->state), answered->position, data_s));
  }
  co_return false;
}

void RunningSteps::note_early_end() {
  if (journal_.record.early_end_s < 0) {
    journal_.record.early_end_s = running_.latest() ? running_.latest()->data_s : 0.0;  // until the last page tells
    journal_.remember(
        "estimate",
        fmt::format("rotation ended early at position {} of {}, {:.0f} s before its time: every "
                    "tolerance is met",
                    journal_.progress.ins.position, journal_.progress.positions, journal_.progress.ins.time_left_s));
  }
}

}  // namespace selfcal
