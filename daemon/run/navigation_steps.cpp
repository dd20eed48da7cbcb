#include "daemon/run/navigation_steps.hpp"

#include <fmt/format.h>

#include "daemon/run/ins_checks.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr double drift_margin_s = 60.0;      // beyond the length of the drift check, of the INS's clock
constexpr double check_stop_limit_s = 30.0;  // of the INS's clock, after it agreed to stop its check

// A routine that cannot be stopped ends by itself; any other refusal is a failure, or a lost session.
bool cannot_be_stopped(const PortError& error) {
  return error.kind == PortError::Kind::negative &&
         (error.nrc == static_cast<std::uint8_t>(uds::Nrc::sub_function_not_supported) ||
          error.nrc == static_cast<std::uint8_t>(uds::Nrc::request_out_of_range) ||
          error.nrc == static_cast<std::uint8_t>(uds::Nrc::conditions_not_correct));
}

}  // namespace

Task<Step> NavigationSteps::measure_drift(double RunRecord::*figure) {
  ins::NavigationCheckRequest request;
  request.duration_s = static_cast<std::uint32_t>(data_.config.drift_check_s);
  request.compensation = ins::Slot::a;  // that is: what is in force
  const auto before = co_await client_.read_state();
  if (!before) {
    co_return tl::unexpected(before.error());
  }
  if (before->power_cycles != data_.power_cycles.value_or(before->power_cycles)) {
    co_return tl::unexpected<PortError>(PortError{
        PortError::Kind::link, 0, data_.config.interface + ": the INS restarted before its navigation check"});
  }
  data_.power_cycles = before->power_cycles;
  // A daemon that was restarted meanwhile finds its own check going on; the INS would refuse another one.
  if (before->state != ins::State::checking) {
    const auto begun = co_await client_.start_check(request);
    if (!begun) {
      co_return tl::unexpected(begun.error());
    }
  }
  const SteadyTime end = timers_.now() + ins_time(data_.config.drift_check_s + drift_margin_s) + 5s;
  while (true) {
    const auto state = co_await client_.read_state();
    if (!state) {
      co_return tl::unexpected(state.error());
    }
    if (state->power_cycles != *data_.power_cycles) {  // the same as a link that was away
      co_return tl::unexpected<PortError>(
          PortError{PortError::Kind::link, 0,
                    data_.config.interface + ": the INS restarted in the middle of its navigation check"});
    }
    const auto drift = co_await client_.check_result();
    if (!drift) {
      co_return tl::unexpected(drift.error());
    }
    if (const Complaint complaint = check_navigation(*drift, request.duration_s)) {
      co_return protocol_error(*complaint);
    }
    if (drift->done) {
      journal_.record.*figure = drift->max_horizontal_m;
      journal_.remember("drift", fmt::format("free-inertial drift over {:.0f} s: {:.1f} m", drift->elapsed_s,
                                             drift->max_horizontal_m));
      break;
    }
    if (timers_.now() > end) {
      co_return protocol_error("the navigation check does not end");
    }
    co_await Sleep(timers_, ins_time(2.0));
  }
  if (figure == &RunRecord::drift_new_m && journal_.record.drift_old_m >= 0 &&
      journal_.record.drift_new_m > journal_.record.drift_old_m) {
    journal_.warn(fmt::format("the INS drifts more with the new set than with the old: {:.1f} m against {:.1f} m",
                              journal_.record.drift_new_m, journal_.record.drift_old_m));
  }
  co_return Event::drift_measured;
}

Task<Answer<Done>> NavigationSteps::stop_check() {
  const auto state = co_await client_.read_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  if (state->state != ins::State::checking) {
    co_return Done{};
  }
  double limit_s = check_stop_limit_s;
  const auto stopped = co_await client_.stop_check();
  if (!stopped) {
    if (!cannot_be_stopped(stopped.error())) {
      co_return tl::unexpected(stopped.error());
    }
    limit_s = data_.config.drift_check_s + drift_margin_s;
    budget_.extend(ins_time(limit_s));
    journal_.warn(fmt::format("{}: the end of the navigation check is waited for, {:.0f} s of the INS's clock at most",
                              stopped.error().message, limit_s));
  }
  if (auto ended = co_await await_state(ins::State::checking, limit_s, "the navigation check goes on"); !ended) {
    co_return tl::unexpected(ended.error());
  }
  journal_.remember("ins", stopped ? "navigation check stopped" : "navigation check over");
  co_return Done{};
}

Task<Step> NavigationSteps::end_check() {
  if (auto ended = co_await stop_check(); !ended) {
    co_return tl::unexpected(ended.error());
  }
  co_return Event::check_ended;
}

}  // namespace selfcal
