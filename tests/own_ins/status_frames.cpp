#include "tests/own_ins/status_frames.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "tests/own_ins/identifiers.hpp"

namespace selfcal::ins {
namespace {

constexpr std::size_t status_bytes = 8;
constexpr std::uint32_t last_state = static_cast<std::uint32_t>(State::checking);

enum SignalIndex : std::size_t {
  state_signal,
  moving_signal,
  unlocked_signal,
  session_signal,
  faults_signal,
  position_signal,
  pages_signal,
  state_alive_signal,
  outer_signal,
  inner_signal,
  time_left_signal,
  gimbal_alive_signal,
};

// No signal is wider than 24 bits, none crosses the end of the frame.
void put_signal(const Signal& signal, std::uint32_t raw, can::CanFrame& frame) {
  assert(raw < 1U << signal.bits);
  for (unsigned bit = 0; bit < signal.bits; ++bit) {
    const unsigned at = signal.start_bit + bit;
    const auto value = static_cast<std::uint8_t>((raw >> bit & 1U) << (at % 8));
    frame.data[at / 8] = static_cast<std::uint8_t>(frame.data[at / 8] | value);
  }
}

can::CanFrame blank(std::uint32_t id) {
  can::CanFrame frame;
  frame.id = id;
  frame.size = status_bytes;
  return frame;
}

std::uint32_t angle_counts(const Signal& signal, double degrees) {
  const double turn = std::fmod(degrees, 360.0);
  const auto counts = static_cast<std::uint32_t>(std::lround((turn < 0 ? turn + 360.0 : turn) / signal.factor));
  return counts % 36000;  // 359.996 rounds to 360: the same as 0
}

}  // namespace

const std::array<Signal, 12> status_signals = {{
    {can_id::status, "State", 0, 4, 1, 0, 6, "",
     "0=starting 1=idle 2=rotating 3=complete 4=aborted 5=failed 6=checking"},
    {can_id::status, "GimbalMoving", 4, 1, 1, 0, 1, "", ""},
    {can_id::status, "Unlocked", 5, 1, 1, 0, 1, "", ""},
    {can_id::status, "Session", 6, 2, 1, 0, 3, "", "1=default 2=programming 3=extended"},
    {can_id::status, "Faults", 8, 8, 1, 0, 255, "", ""},
    {can_id::status, "Position", 16, 8, 1, 0, 255, "", ""},
    {can_id::status, "PagesWritten", 24, 24, 1, 0, 16777215, "page", ""},
    {can_id::status, "StateAlive", 56, 8, 1, 0, 255, "", ""},
    {can_id::gimbal, "OuterAngle", 0, 16, 0.01, 0, 359.99, "deg", ""},
    {can_id::gimbal, "InnerAngle", 16, 16, 0.01, 0, 359.99, "deg", ""},
    {can_id::gimbal, "TimeLeft", 32, 16, 0.1, 0, 6553.5, "s", ""},
    {can_id::gimbal, "GimbalAlive", 56, 8, 1, 0, 255, "", ""},
}};

can::CanFrame encode_state_frame(const Status& status, std::uint8_t alive, std::uint32_t id) {
  can::CanFrame frame = blank(id);
  put_signal(status_signals[state_signal], static_cast<std::uint32_t>(status.state), frame);
  put_signal(status_signals[moving_signal], status.moving ? 1 : 0, frame);
  put_signal(status_signals[unlocked_signal], status.unlocked ? 1 : 0, frame);
  put_signal(status_signals[session_signal], status.session & 3U, frame);
  put_signal(status_signals[faults_signal], status.faults, frame);
  put_signal(status_signals[position_signal], status.position, frame);
  put_signal(status_signals[pages_signal], std::min<std::uint32_t>(status.pages_written, 0xFFFFFF), frame);
  put_signal(status_signals[state_alive_signal], alive, frame);
  return frame;
}

can::CanFrame encode_gimbal_frame(const Status& status, std::uint8_t alive, std::uint32_t id) {
  can::CanFrame frame = blank(id);
  const Signal& time_left = status_signals[time_left_signal];
  const double seconds = std::clamp(status.time_left_s, time_left.minimum, time_left.maximum);
  put_signal(status_signals[outer_signal], angle_counts(status_signals[outer_signal], status.outer_deg), frame);
  put_signal(status_signals[inner_signal], angle_counts(status_signals[inner_signal], status.inner_deg), frame);
  put_signal(time_left, static_cast<std::uint32_t>(std::lround(seconds / time_left.factor)), frame);
  put_signal(status_signals[gimbal_alive_signal], alive, frame);
  return frame;
}

std::uint32_t raw_signal(const Signal& signal, std::span<const std::uint8_t> payload) {
  assert(payload.size() == status_bytes);
  std::uint32_t raw = 0;
  for (unsigned bit = 0; bit < signal.bits; ++bit) {
    const unsigned at = signal.start_bit + bit;
    raw |= (payload[at / 8] >> (at % 8) & 1U) << bit;
  }
  return raw;
}

bool apply_status_frame(const can::CanFrame& frame, Status& status) {
  const bool is_state = frame.id == can_id::status;
  if (frame.extended || frame.remote || frame.size != status_bytes || (!is_state && frame.id != can_id::gimbal)) {
    return false;
  }
  const auto raw = [&](SignalIndex index) { return raw_signal(status_signals[index], frame.payload()); };
  const auto physical = [&](SignalIndex index) { return raw(index) * status_signals[index].factor; };
  if (!is_state) {
    status.outer_deg = physical(outer_signal);
    status.inner_deg = physical(inner_signal);
    status.time_left_s = physical(time_left_signal);
    return true;
  }
  if (raw(state_signal) > last_state) {
    return false;
  }
  status.state = static_cast<State>(raw(state_signal));
  status.moving = raw(moving_signal) != 0;
  status.unlocked = raw(unlocked_signal) != 0;
  status.session = static_cast<std::uint8_t>(raw(session_signal));
  status.faults = static_cast<std::uint8_t>(raw(faults_signal));
  status.position = static_cast<std::uint8_t>(raw(position_signal));
  status.pages_written = raw(pages_signal);
  return true;
}

}  // namespace selfcal::ins
