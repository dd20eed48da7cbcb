// What an INS that is turned move by move says of itself, and what follows from it.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "daemon/ins/move_port.hpp"
#include "protocol/profile/records.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal {
namespace {

constexpr double radians_per_degree = 3.14159265358979323846 / 180.0;

double in_turn(double degrees) { return degrees - 360.0 * std::floor(degrees / 360.0); }

}  // namespace

Expected<ins::StateRecord> MovePort::state_in(const Bytes& response) const {
  const auto record = uds::read_read_response(response, *config_.profile->state.did);
  return record ? profile::decode_state(*config_.profile, *record) : tl::unexpected(record.error());
}

// It records for a rotation of which nothing is known here: the service was restarted, or the answer to the start was lost.
bool MovePort::lost(const ins::StateRecord& state) const {
  return state.state == ins::State::rotating && sequence_.phase() == Phase::none && session_open_ && !stopped_;
}

void MovePort::observe(const ins::StateRecord& state) {
  const Phase before = sequence_.phase();
  follow(state);
  if (moved_ && (move().turning.by_angle ? sequence_.rests(now_s()) : !state.moving)) {
    moved_ = false;
  }
  take_phase(before);
  if (!config_.status_id) {
    tell_status(state);
  }
}

void MovePort::follow(const ins::StateRecord& state) {
  const bool starts = sequence_.phase() == Phase::dwelling && !recording_;
  const bool by_angle = move().turning.by_angle;
  const std::array<double, 2> gimbal{state.outer_deg * radians_per_degree, state.inner_deg * radians_per_degree};
  if (starts || wanted_ == Own::move) {  // what the gimbal does yet is of the position before
    static_cast<void>(waits() && sequence_.on_time(now_s(), nullptr));
    return;
  }
  if (turning() && state.state == ins::State::failed) {
    return sequence_.fail("the INS says that it failed");
  }
  if (sequence_.active() && state.state != ins::State::rotating) {
    return sequence_.fail(fmt::format("the INS does not record any more, it is {}", ins::name(state.state)));
  }
  if (!by_angle && state.moving && sequence_.phase() == Phase::dwelling) {
    return sequence_.fail(fmt::format("position {} is left before its time: the gimbal turns", sequence_.position()));
  }
  if (!by_angle) {
    sequence_.on_state(now_s(), state.moving ? profile::FrameState::moving : profile::FrameState::idle, nullptr);
  }
  if (sequence_.on_time(now_s(), by_angle ? &gimbal : nullptr)) {
    wanted_ = Own::move;
  }
}

// What follows from where the sequence has got to.
void MovePort::take_phase(Phase before) {
  const Phase phase = sequence_.phase();
  if (phase == before) {
    return;
  }
  if (phase == Phase::failed) {
    return break_off(not_taken_.empty() ? sequence_.why() : fmt::format("{}: {}", sequence_.why(), not_taken_));
  }
  if (phase == Phase::dwelling && !recording_) {
    wanted_ = Own::start;
  } else if (phase == Phase::over) {
    wanted_ = Own::end;
  }
  watch();
}

// Where the INS sends no status frames.
void MovePort::tell_status(const ins::StateRecord& state) {
  const std::pair<std::size_t, bool> shown{turning() ? sequence_.position() : 0, state.moving || waits()};
  const bool goes_on = recording_ && sequence_.phase() == Phase::dwelling;  // its time does
  if ((shown == shown_ && !goes_on) || !on_status) {
    return;
  }
  shown_ = shown;
  ins::Status status;
  status.state = as_rotation(state.state);
  status.faults = state.faults;
  status.position = static_cast<std::uint8_t>(shown.first);
  status.moving = shown.second;
  status.time_left_s = sequence_.left_s(now_s());
  status.session = 0;
  status.pages_written = pages_written_;
  status.outer_deg = in_turn(state.outer_deg);
  status.inner_deg = in_turn(state.inner_deg);
  on_status(status);
}

ins::State MovePort::as_rotation(ins::State told) const {
  if (told == ins::State::starting || told == ins::State::checking) {
    return told;
  }
  if (turning()) {
    return ins::State::rotating;
  }
  const bool rests = told != ins::State::rotating && !moved_;
  if (rests && told == ins::State::failed) {
    return told;
  }
  if (sequence_.phase() == Phase::over) {
    return ended_ && rests ? ins::State::complete : ins::State::rotating;
  }
  if (!rests) {
    return ins::State::rotating;
  }
  if (sequence_.phase() == Phase::failed) {
    return ins::State::failed;
  }
  // Of a recording that is whole by the INS's word, and of which nothing is known here, the moves may be missing.
  return stopped_ ? ins::State::aborted : told == ins::State::complete ? ins::State::idle : told;
}

// What was recorded until then is no rotation. The service stops the INS when it has heard of it.
void MovePort::break_off(std::string why, std::optional<PortError> error) {
  if (sequence_.phase() == Phase::none) {
    return;
  }
  why = fmt::format("the rotation is broken off at position {}: {}", sequence_.position(), why);
  sequence_.fail(why);
  wanted_ = Own::nothing;
  timers_.cancel(std::exchange(watch_timer_, 0));
  if (start_.empty()) {
    unsaid_ = std::move(why);
    return;
  }
  start_.clear();
  PortError told = trouble(why);
  if (error) {
    told.kind = error->kind;
    told.nrc = error->nrc;
  }
  answer_later(tl::unexpected(std::move(told)));
}

}  // namespace selfcal
