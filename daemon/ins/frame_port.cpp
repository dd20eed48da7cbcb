#include "daemon/ins/frame_port.hpp"

#include <fmt/format.h>
#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "protocol/profile/frame_values.hpp"
#include "protocol/profile/gimbal_axes.hpp"
#include "protocol/profile/records.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using Phase = MoveSequence::Phase;
using profile::FrameState;
using uds::Nrc;

constexpr auto full_queue_retry = 1ms;  // ENOBUFS has no event
constexpr auto silence_limit = 5s;      // of the stream, while it is to come
constexpr int batches_per_turn = 16;

double in_turn_deg(double radians) {
  const double degrees = radians * 180.0 / std::numbers::pi;
  return degrees - 360.0 * std::floor(degrees / 360.0);
}

std::chrono::nanoseconds seconds(double s) { return std::chrono::nanoseconds(static_cast<std::int64_t>(s * 1e9)); }

}  // namespace

FramePort::FramePort(EventLoop& loop, const InsConfig& config) : loop_(loop), config_(config), stream_(config.profile) {
  open();
}

FramePort::~FramePort() {
  for (const Timers::Id timer : {send_timer_, wait_timer_, answer_timer_, stream_timer_}) {
    loop_.cancel(timer);
  }
}

void FramePort::open() {
  can::SocketOptions options;
  options.interface = config_.interface;
  options.fd = config_.profile->bus.fd;
  const auto hear = [&](const profile::Frame& frame) {
    options.filters.push_back({frame.id, 0x1FFFFFFF, config_.profile->bus.extended_ids});
  };
  hear(frames().identity);
  hear(frames().state);
  hear(frames().told);
  std::ranges::for_each(frames().samples, hear);
  auto socket = can::Socket::open(options);
  if (!socket) {
    return down(socket.error());
  }
  socket_ = std::move(*socket);
  trouble_.clear();
  io_ = std::make_unique<EventLoop::Io>(loop_, socket_->fd(), EPOLLIN, [this](unsigned) { on_readable(); });
}

void FramePort::down(const Error& error) {
  trouble_ = error.message;
  if (io_) {
    io_->want(0);
  }
  break_off("the interface is down");
  if (done_) {
    answer_link(trouble_);
  }
}

void FramePort::reopen() {
  io_.reset();
  lost_before_ = lost_frames();
  socket_.reset();
  break_off("the connection was opened anew");
  if (done_) {
    answer_link("connection opened anew");
  }
  open();
}

// --- frames of the INS

void FramePort::on_readable() {
  for (int batch = 0; batch < batches_per_turn; ++batch) {
    const auto received = socket_->receive();
    if (!received) {
      return down(received.error());
    }
    for (const can::ReceivedFrame& one : *received) {
      if (!one.event) {
        take(one.frame);
      } else if (on_bus_event) {
        on_bus_event(*one.event);
      }
    }
    if (received->empty()) {
      return;
    }
  }
}

void FramePort::take(const can::CanFrame& frame) {
  const auto is = [&](const profile::Frame& kind) { return frame.id == kind.id && frame.size >= kind.bytes; };
  if (frame.extended != config_.profile->bus.extended_ids || frame.remote) {
    return;
  }
  if (is(frames().identity)) {
    take_identity(frame);
  } else if (is(frames().state)) {
    take_state(frame);
  } else if (is(frames().told)) {
    take_told(frame);
  } else {
    if (stream_.take(frame)) {
      after_sample();
    }
    if (!stream_.trouble().empty() && turning()) {
      break_off(stream_.trouble());
    }
  }
}

void FramePort::take_identity(const can::CanFrame& frame) {
  if (wait_ != Wait::serial && wait_ != Wait::software) {
    return;
  }
  const std::string_view name = wait_ == Wait::serial ? "serial" : "software";
  const bool told = frames().identity.find(name) != nullptr;
  const std::string text = told ? fmt::format("{}", raw(frames().identity, name, frame)) : "not told";
  positive(Bytes(text.begin(), text.end()));
}

void FramePort::take_state(const can::CanFrame& frame) {
  const profile::Signal& signal = *frames().state.find("state");
  const std::uint64_t told = profile::raw_of(signal, frame.payload());
  const auto code = std::ranges::find_if(signal.codes, [&](const auto& pair) { return pair.second == told; });
  if (code == signal.codes.end()) {
    if (wait_ == Wait::state) {
      answer(tl::unexpected(
          trouble(PortError::Kind::protocol, fmt::format("state frame: {} is the code of no state", told))));
    }
    return;
  }
  const auto state = static_cast<FrameState>(code->first);
  const auto outer = value(frames().state, "outer", frame), inner = value(frames().state, "inner", frame);
  const std::array angles{outer.value_or(0.0), inner.value_or(0.0)};
  sequence_.on_state(stream_s(), state, outer && inner ? &angles : nullptr);
  if (sequence_.phase() == Phase::failed && unsaid_.empty() && run_id_ != 0) {
    break_off(sequence_.why());
  }
  if (wait_ == Wait::first_position && sequence_.phase() == Phase::dwelling) {
    stream_.begin();
    watch_stream();
    if (frames().start) {
      command(*frames().start);
    }
    positive({});
  }
  tell_status(state, frame);
  if (wait_ == Wait::state && !unsaid_.empty()) {
    answer(tl::unexpected(trouble(PortError::Kind::protocol, std::exchange(unsaid_, {}))));
  } else if (wait_ == Wait::state) {
    positive(state_record(state, frame));
  }
}

// As an INS that turns a schedule by itself tells in its status frames.
void FramePort::tell_status(FrameState told, const can::CanFrame& frame) const {
  if (!on_status) {
    return;
  }
  ins::Status status;
  status.state = run_state(told);
  status.position = static_cast<std::uint8_t>(turning() ? sequence_.position() : 0);
  status.moving =
      told == FrameState::moving || sequence_.phase() == Phase::approaching || sequence_.phase() == Phase::moving;
  status.session = 0;
  status.pages_written = pages_written();
  const std::array seen = stream_.gimbal();
  const auto ours =
      profile::in_our_axes<double>(*config_.profile, {value(frames().state, "outer", frame).value_or(seen[0]),
                                                      value(frames().state, "inner", frame).value_or(seen[1])});
  status.outer_deg = in_turn_deg(ours[0]);
  status.inner_deg = in_turn_deg(ours[1]);
  status.time_left_s = sequence_.left_s(stream_s());
  on_status(status);
}

void FramePort::take_told(const can::CanFrame& frame) {
  const auto did = static_cast<std::uint16_t>(request_.size() >= 3 ? request_[1] << 8U | request_[2] : 0);
  if (wait_ != Wait::told || raw(frames().told, "index", frame) + profile::first_index_did != did) {
    return;
  }
  if (request_[0] == uds::service::write_data) {
    return positive({});
  }
  positive(bytes_of(*field_of(*config_.profile, did), raw(frames().told, "value", frame)));
}

// --- the rotation

void FramePort::after_sample() {
  const std::array<double, 2> gimbal = stream_.gimbal();
  if (sequence_.on_time(stream_s(), &gimbal)) {
    return command_move();
  }
  if (sequence_.phase() == Phase::over) {
    end_stream();
  } else if (sequence_.phase() == Phase::failed) {
    break_off(sequence_.why());
  }
}

void FramePort::end_stream() {
  stream_.end();
  loop_.cancel(std::exchange(stream_timer_, 0));
  if (frames().stop) {
    command(*frames().stop);
  }
}

// What came until then is no rotation: it is not used.
void FramePort::break_off(std::string why) {
  const bool was_failed = sequence_.phase() == Phase::failed;
  if (!turning() && !was_failed) {
    return;
  }
  end_stream();
  sequence_.fail(why);
  unsaid_ = fmt::format("the rotation is broken off at position {}: {}", sequence_.position(), why);
  if (wait_ == Wait::first_position) {
    answer(tl::unexpected(trouble(PortError::Kind::protocol, std::exchange(unsaid_, {}))));
  }
}

void FramePort::watch_stream() {
  samples_seen_ = stream_.samples();
  stream_timer_ = loop_.after(silence_limit, [this] {
    stream_timer_ = 0;
    if (!sequence_.active()) {
      return;
    }
    if (stream_.samples() == samples_seen_) {
      return break_off(fmt::format("no sample came for {} s behind sample {}",
                                   std::chrono::duration<double>(silence_limit).count(), samples_seen_));
    }
    watch_stream();
  });
}

void FramePort::command_move() {
  const auto target = sequence_.target();
  const profile::Signal& outer = *frames().move.find("outer");
  const profile::Signal& inner = *frames().move.find("inner");
  const auto raw_outer = profile::raw_for(outer, target[0]), raw_inner = profile::raw_for(inner, target[1]);
  if (!raw_outer || !raw_inner) {
    return break_off(fmt::format("frame move cannot hold position {}: {:.3f} and {:.3f} rad", sequence_.position(),
                                 target[0], target[1]));
  }
  command(frames().move, {{"outer", *raw_outer}, {"inner", *raw_inner}});
}

// The INS's clock: its samples.
double FramePort::stream_s() const {
  return static_cast<double>(stream_.samples()) / config_.profile->sample_format.given.at("sample_rate");
}

std::uint32_t FramePort::pages_written() const {
  const bool whole = sequence_.active();  // the page that is being filled does not count
  return whole ? static_cast<std::uint32_t>(stream_.samples() / flash::samples_per_page) : stream_.pages_begun();
}

ins::State FramePort::run_state(FrameState told) const {
  if (told == FrameState::starting) {
    return ins::State::starting;
  }
  switch (sequence_.phase()) {
    case Phase::approaching:
    case Phase::dwelling:
    case Phase::moving: return ins::State::rotating;
    case Phase::over: return told == FrameState::moving ? ins::State::rotating : ins::State::complete;
    case Phase::failed: return told == FrameState::moving ? ins::State::rotating : ins::State::failed;
    default: break;
  }
  if (told == FrameState::moving) {
    return ins::State::rotating;
  }
  return told == FrameState::failed ? ins::State::failed : stopped_ ? ins::State::aborted : ins::State::idle;
}

Bytes FramePort::state_record(FrameState told, const can::CanFrame& frame) const {
  ins::StateRecord record;
  record.state = run_state(told);
  record.run_id = run_id_;
  record.power_cycles = static_cast<std::uint32_t>(raw(frames().state, "power_cycles", frame));
  record.coefficients_version = static_cast<std::uint32_t>(value(frames().state, "version", frame).value_or(0.0));
  return *profile::encode(*config_.profile, record);
}

// --- frames to the INS

void FramePort::command(const profile::Frame& kind,
                        std::initializer_list<std::pair<std::string_view, std::uint64_t>> raw) {
  can::CanFrame frame;
  frame.id = kind.id;
  frame.extended = config_.profile->bus.extended_ids;
  frame.fd = frame.bit_rate_switch = config_.profile->bus.fd;
  frame.size = static_cast<std::uint8_t>(kind.bytes);
  const std::span<std::uint8_t> data = std::span(frame.data).first(kind.bytes);
  for (const profile::Signal& signal : kind.signals) {
    if (signal.constant) {
      profile::put_raw(signal, *signal.constant, data);
    }
  }
  for (const auto& [name, bits] : raw) {
    profile::put_raw(*kind.find(name), bits, data);
  }
  outgoing_.push_back(frame);
  pump();
}

void FramePort::pump() {
  loop_.cancel(std::exchange(send_timer_, 0));
  while (!outgoing_.empty() && socket_ && trouble_.empty()) {
    const auto taken = socket_->send(std::span(&outgoing_.front(), 1));
    if (!taken) {
      outgoing_.clear();
      return down(taken.error());
    }
    if (*taken == 0) {
      send_timer_ = loop_.after(full_queue_retry, [this] {
        send_timer_ = 0;
        pump();
      });
      return;
    }
    outgoing_.pop_front();
  }
}

// --- answers

void FramePort::wait_for(Wait what, std::string name, double within_s) {
  wait_ = what;
  // A move takes the INS's time, an answer the bus's.
  const double real_s =
      what == Wait::first_position ? within_s / config_.time_scale + config_.request_timeout_s : within_s;
  loop_.cancel(wait_timer_);
  wait_timer_ = loop_.after(seconds(real_s), [this, name = std::move(name), real_s] {
    wait_timer_ = 0;
    if (wait_ == Wait::first_position) {
      sequence_.fail("the first position is not reached");
      end_stream();
    }
    answer_link(fmt::format("no {} within {:g} s", name, real_s));
  });
}

void FramePort::positive(Bytes tail) {
  // What the answer repeats of the request: sub-function, identifier, or action and routine.
  static constexpr std::array<std::pair<std::uint8_t, std::size_t>, 6> repeated{{{uds::service::session_control, 1},
                                                                                 {uds::service::ecu_reset, 1},
                                                                                 {uds::service::read_data, 2},
                                                                                 {uds::service::write_data, 2},
                                                                                 {uds::service::routine_control, 3},
                                                                                 {uds::service::read_memory, 0}}};
  const auto found = std::ranges::find(repeated, request_.front(), &std::pair<std::uint8_t, std::size_t>::first);
  Bytes response{static_cast<std::uint8_t>(request_.front() + uds::positive_offset)};
  response.insert(response.end(), request_.begin() + 1,
                  request_.begin() + 1 + static_cast<std::ptrdiff_t>(found->second));
  response.insert(response.end(), tail.begin(), tail.end());
  answer(std::move(response));
}

void FramePort::refuse(Nrc nrc) {
  answer(tl::unexpected(PortError{PortError::Kind::negative, static_cast<std::uint8_t>(nrc),
                                  fmt::format("{}: {}: {}", config_.interface, uds::service_name(request_.front()),
                                              uds::describe_nrc(static_cast<std::uint8_t>(nrc)))}));
}

PortError FramePort::trouble(PortError::Kind kind, const std::string& what) const {
  const bool named = what.find(config_.interface) != std::string::npos;
  return {kind, 0, named ? what : fmt::format("{}: {}", config_.interface, what)};
}

void FramePort::answer_link(const std::string& why) { answer(tl::unexpected(trouble(PortError::Kind::link, why))); }

// From the loop, never from inside request().
void FramePort::answer(Answer<Bytes> result) {
  wait_ = Wait::nothing;
  loop_.cancel(std::exchange(wait_timer_, 0));
  loop_.cancel(answer_timer_);
  answer_timer_ = loop_.after(0ns, [this, result = std::move(result)]() mutable {
    answer_timer_ = 0;
    if (const auto done = std::exchange(done_, {})) {
      done(std::move(result));
    }
  });
}

}  // namespace selfcal
