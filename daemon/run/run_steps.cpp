#include "daemon/run/run_steps.hpp"

#include <fmt/format.h>

namespace selfcal {

using namespace std::chrono_literals;

RunSteps::RunSteps(const StepContext& context)
    : timers_(context.timers),
      port_(context.port),
      store_(context.store),
      client_(context.client),
      budget_(context.budget),
      journal_(context.journal),
      data_(context.data) {}

Task<Answer<ins::StateRecord>> RunSteps::ask_state() {
  const SteadyTime asked = timers_.now();
  const auto state = co_await client_.read_state();
  if (state) {
    data_.rotation_clock.state_told(state->state == ins::State::rotating, asked, timers_.now());
  }
  co_return state;
}

Task<Answer<Done>> RunSteps::await_state(ins::State unwanted, double limit_s, std::string what) {
  const SteadyTime end = timers_.now() + ins_time(limit_s) + 1s;
  while (true) {
    const auto state = co_await ask_state();
    if (!state) {
      co_return tl::unexpected(state.error());
    }
    data_.state = *state;
    if (state->state != unwanted) {
      co_return Done{};
    }
    if (timers_.now() > end) {
      co_return protocol_error(fmt::format("{} after {:.0f} s", what, limit_s));
    }
    co_await Sleep(timers_, ins_time(0.5));
  }
}

void RunSteps::progressed() {
  budget_.progressed();
  client_.tally().forget();
}

tl::unexpected<PortError> RunSteps::protocol_error(const std::string& message) const {
  return tl::unexpected<PortError>(
      PortError{PortError::Kind::protocol, 0, fmt::format("{}: {}", data_.config.interface, message)});
}

tl::unexpected<PortError> RunSteps::local_trouble(const Error& error) const {
  return tl::unexpected<PortError>(PortError{PortError::Kind::local, 0, error.message});
}

std::chrono::nanoseconds RunSteps::ins_time(double seconds) const {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(seconds / data_.config.time_scale * 1e9));
}

std::string RunSteps::what_the_ins_holds() const { return selfcal::what_the_ins_holds(data_, budget_.main_path()); }

std::string what_the_ins_holds(const RunData& data, State main_path) {
  if (data.old_set_put_back) {
    return "the old set was put back and is in force";
  }
  if (!data.config.profile->slots && main_path >= State::writing && main_path < State::checking_new) {
    return "the INS has no second slot: part of the new set may stand over the old one, which is kept here";
  }
  if (data.new_set_in_force()) {
    return "the new set is in force";
  }
  if (main_path >= State::resetting) {
    return "the new set is committed, and in force after the next power-on of the INS";
  }
  if (main_path == State::committing && data.commit_asked) {
    return "the commit was asked for and not confirmed: the old set or the new one is in force after the next power-on";
  }
  return "the old set is in force";
}

}  // namespace selfcal
