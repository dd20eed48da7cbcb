#include "sim_ins/device/frame_node.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "estimator/geometry/units.hpp"
#include "protocol/profile/frame_values.hpp"
#include "protocol/uds/messages.hpp"
#include "sim_ins/device/sample_frames.hpp"

namespace selfcal::sim {
namespace {

using profile::Frame;
using profile::FrameState;
using profile::Signal;

constexpr double status_interval_s = 0.1;       // INS time, but
constexpr double least_real_interval_s = 0.02;  // never more often than this in real time
constexpr double longest_step_s = 0.02;  // of real time at once, so that the clock does not run ahead of the tester
constexpr int sleep_ms = 1;
constexpr int software_number = 1;

Time real_now() { return std::chrono::duration_cast<Time>(std::chrono::steady_clock::now().time_since_epoch()); }
double seconds(Time t) { return std::chrono::duration<double>(t).count(); }

// The number at the end of a serial number; an INS of frames tells no text.
double number_of(const std::string& serial) {
  const std::size_t last = serial.find_last_not_of("0123456789");
  return std::strtod(serial.c_str() + (last == std::string::npos ? 0 : last + 1), nullptr);
}

bool is(const Frame& kind, const can::CanFrame& frame) {
  return frame.id == kind.id && frame.size == kind.bytes &&
         std::ranges::all_of(kind.signals, [&](const Signal& signal) {
           return !signal.constant || profile::raw_of(signal, frame.payload()) == *signal.constant;
         });
}

}  // namespace

Expected<std::unique_ptr<FrameNode>> FrameNode::open(const NodeOptions& options, Instrument& instrument,
                                                     CommandedGimbal gimbal) {
  const profile::Profile& profile = *options.diagnostics.profile;
  const profile::Frames& frames = *profile.frames;
  can::SocketOptions socket_options;
  socket_options.interface = options.interface;
  socket_options.fd = profile.bus.fd;
  for (const Frame* kind : {&frames.move, &frames.read, &frames.write, &frames.reset,
                            frames.start ? &*frames.start : nullptr, frames.stop ? &*frames.stop : nullptr}) {
    if (kind != nullptr) {
      socket_options.filters.push_back(
          {kind->id, profile.bus.extended_ids ? 0x1FFFFFFFU : 0x7FFU, profile.bus.extended_ids});
    }
  }
  auto socket = can::Socket::open(socket_options);
  if (!socket) {
    return tl::unexpected(socket.error());
  }
  return std::unique_ptr<FrameNode>(new FrameNode(options, instrument, std::move(gimbal), std::move(*socket)));
}

FrameNode::FrameNode(const NodeOptions& options, Instrument& instrument, CommandedGimbal gimbal, can::Socket socket)
    : options_(options),
      instrument_(instrument),
      gimbal_(std::move(gimbal)),
      store_(instrument, options.diagnostics),
      socket_(std::move(socket)),
      bus_(options.rates),
      faulty_(options.scenario) {}

Time FrameNode::ins_time() const { return std::chrono::duration_cast<Time>(std::chrono::duration<double>(now_s_)); }

void FrameNode::reset(Time now) {
  instrument_.power_on(now_s_);
  gimbal_.power_on(now_s_);
  store_.power_on(now);
  uds::Bytes opened;  // the store is written in a session; there is no lock
  store_.handle(uds::session_request(static_cast<uds::Session>(profile().session)), opened, now);
}

// --- frames to the tester

void FrameNode::send(can::CanFrame frame) {
  if (acts(FaultKind::bus_off)) {
    return;
  }
  out_.clear();
  faulty_.pass(frame, now_s_, out_);
  for (const can::CanFrame& one : out_) {
    bus_.transmit(one, ins_time());
    for (auto taken = socket_.send({&one, 1}); taken && *taken == 0; taken = socket_.send({&one, 1})) {
      pollfd waiting{socket_.fd(), POLLOUT, 0};  // the queue is full: the INS's clock stands meanwhile
      ::poll(&waiting, 1, sleep_ms);
    }
  }
}

void FrameNode::tell_state() {
  if (now_s_ < next_status_s_) {
    return;
  }
  next_status_s_ = now_s_ + std::max(status_interval_s, least_real_interval_s * options_.speed);
  can::CanFrame identity = begin_frame(profile(), frames().identity);
  put_value(frames().identity, "serial", number_of(instrument_.serial()), identity);
  put_value(frames().identity, "software", software_number, identity);
  send(identity);
  if (acts(FaultKind::late_status)) {
    return faulty_.count(FaultKind::late_status);
  }
  FrameState state = !instrument_.ready()      ? FrameState::starting
                     : gimbal_.turning(now_s_) ? FrameState::moving
                                               : FrameState::idle;
  if (acts(FaultKind::wrong_status)) {
    faulty_.count(FaultKind::wrong_status);
    state = FrameState::idle;
  }
  const Frame& kind = frames().state;
  const profile::Raw& axes = profile().raw;
  can::CanFrame frame = begin_frame(profile(), kind);
  const Signal& signal = *kind.find("state");
  const auto code = signal.codes.find(static_cast<std::uint64_t>(state));
  profile::put_raw(signal, code == signal.codes.end() ? static_cast<std::uint64_t>(state) : code->second,
                   std::span(frame.data).first(kind.bytes));
  put_value(kind, "power_cycles", instrument_.counters().get().power_cycles, frame);
  put_value(kind, "version", instrument_.coefficients().in_force().version, frame);
  const auto ours = gimbal_.angles(now_s_);
  constexpr std::string_view names[] = {"outer", "inner"};
  for (std::size_t k = 0; k < 2; ++k) {
    put_value(kind, names[axes.gimbal[k]], std::remainder(axes.gimbal_sign[k] * ours[k], 360.0 * units::degree), frame);
  }
  send(frame);
}

void FrameNode::tell_sample(const ImuSample& sample) {
  const std::uint64_t counter = counter_++;
  if (sample.missing) {
    return;
  }
  std::vector<can::CanFrame> frames;
  append_sample(profile(), sample, counter, frames);
  for (const can::CanFrame& frame : frames) {
    send(frame);
  }
}

// --- frames of the tester

void FrameNode::move(const can::CanFrame& frame) {
  const profile::Raw& axes = profile().raw;
  constexpr std::string_view names[] = {"outer", "inner"};
  std::array<double, 2> target{};
  for (std::size_t k = 0; k < 2; ++k) {
    target[k] = axes.gimbal_sign[k] * profile::value(frames().move, names[axes.gimbal[k]], frame).value_or(0.0);
  }
  gimbal_.turn_to(target, now_s_);
}

void FrameNode::ask_store(std::uint16_t did, std::span<const std::uint8_t> record, Time now) {
  asked_did_ = did;
  uds::Bytes answer;
  const auto request = record.empty() ? uds::read_request(did) : uds::write_request(did, record);
  if (store_.handle(request, answer, now) == uds::RequestHandler::Answer::now) {
    tell_coefficient(answer);
  }
}

// What was written is told as it is held; a refusal is not told at all.
void FrameNode::tell_coefficient(std::span<const std::uint8_t> answer) {
  if (answer.size() < 3 || answer[0] == uds::service::negative_response) {
    return;
  }
  if (answer[0] == uds::service::write_data + uds::positive_offset) {
    uds::Bytes read;
    store_.handle(uds::read_request(asked_did_), read, real_now());
    return tell_coefficient(read);
  }
  const Frame& kind = frames().told;
  can::CanFrame frame = begin_frame(profile(), kind);
  const auto data = std::span(frame.data).first(kind.bytes);
  profile::put_raw(*kind.find("index"), asked_did_ - profile::first_index_did, data);
  const profile::Field& field = *profile::field_of(profile(), asked_did_);
  profile::put_raw(*kind.find("value"), profile::bits_of(field, answer.subspan(3)), data);
  send(frame);
}

void FrameNode::take(const can::CanFrame& frame, Time now) {
  const profile::Frames& f = frames();
  if (is(f.move, frame)) {
    move(frame);
  } else if (f.start && is(*f.start, frame)) {
    if (const auto started = gimbal_.start(now_s_); !started) {
      fmt::print(stderr, "sim_ins: no samples: {}\n", started.error().message);
    }
  } else if (f.stop && is(*f.stop, frame)) {
    gimbal_.stop(now_s_);
  } else if (is(f.reset, frame)) {
    reset(now);
  } else if (is(f.read, frame) || is(f.write, frame)) {
    const Frame& kind = is(f.write, frame) ? f.write : f.read;
    const auto did = static_cast<std::uint16_t>(profile::first_index_did + profile::raw(kind, "index", frame));
    const profile::Field* field = profile::field_of(profile(), did);
    if (field != nullptr) {
      ask_store(did, &kind == &f.write ? profile::bytes_of(*field, profile::raw(kind, "value", frame)) : uds::Bytes(),
                now);
    }
  }
}

void FrameNode::receive(Time now) {
  while (true) {
    const auto received = socket_.receive();
    if (!received || received->empty()) {
      return;
    }
    for (const can::ReceivedFrame& one : *received) {
      const bool hears = instrument_.ready() && !acts(FaultKind::bus_off);
      if (!one.event && hears && one.frame.extended == profile().bus.extended_ids) {
        take(one.frame, now);
      }
    }
  }
}

// --- time

void FrameNode::advance_clock(Time now) {
  const double real_step = seconds(now - real_before_);
  real_before_ = now;
  now_s_ += options_.speed * std::min(real_step, longest_step_s);
  store_.set_instrument_time(now_s_);
  instrument_.advance(now_s_);
  if (const auto answer = store_.take_answer()) {
    tell_coefficient(*answer);
  }
  const ins::State state = gimbal_.streaming() ? ins::State::rotating : instrument_.state();
  options_.scenario.note_state(state, now_s_);
  faulty_.note_state(state, now_s_);
  std::vector<Fault>& faults = options_.scenario.faults;
  const auto due = std::ranges::find_if(faults, [this](const Fault& fault) {
    return fault.kind == FaultKind::reset && !fault.state && now_s_ >= fault.at_s;
  });
  if (due != faults.end()) {  // each happens once
    faults.erase(due);
    faulty_.count(FaultKind::reset);
    fmt::print(stderr, "sim_ins: reset on demand at {:.3f} s, {}\n", now_s_, ins::name(state));
    reset(now);
  }
}

void FrameNode::run(const volatile int& stop) {
  real_before_ = real_now();
  reset(real_before_);
  while (stop == 0) {
    const Time now = real_now();
    receive(now);
    advance_clock(now);
    tell_state();
    for (const ImuSample& sample : gimbal_.take(now_s_)) {
      tell_sample(sample);
    }
    out_.clear();
    faulty_.flush(now_s_, out_);
    for (const can::CanFrame& late : out_) {
      static_cast<void>(socket_.send({&late, 1}));
    }
    pollfd waiting{socket_.fd(), POLLIN, 0};
    ::poll(&waiting, 1, sleep_ms);
  }
  const std::string acted = faulty_.tally();
  fmt::print(stderr, "sim_ins: switched off at {:.3f} s; bus {:.1f} % busy; faults of the bus that acted: {}\n", now_s_,
             100.0 * seconds(bus_.busy()) / now_s_, acted.empty() ? "none" : acted);
}

}  // namespace selfcal::sim
