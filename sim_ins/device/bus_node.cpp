#include "sim_ins/device/bus_node.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocol/profile/status_frames.hpp"
#include "sim_ins/device/sample_frames.hpp"

namespace selfcal::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t frames_per_call = 128;
constexpr double status_interval_s = 0.2;       // INS time, but
constexpr double least_real_interval_s = 0.02;  // never more often than this in real time
// Largest steps of the INS's clock in one turn of the loop. During an upload small ones, so that frames go out as a
// real bus would carry them, however fast the clock is asked to run. A compressed clock does not make up for what the
// host takes from all of us: the tester's time-outs run in real time, and it would meet an INS that is far ahead.
constexpr double longest_step_s = 2.0;
constexpr double longest_compressed_step_s = 0.02;  // times the speed
constexpr double longest_step_in_upload_s = 0.025;
// How long the loop sleeps where no frame comes: while nothing is under way, no longer than until the next status.
constexpr int short_sleep_ms = 1, long_sleep_ms = 10;
// During an upload, while it is the tester's turn, the clock stands: a tester in compressed time is not charged its
// own run time a hundredfold. But not for longer than this, should it have gone.
constexpr Time patience = 200ms;

Time real_now() { return std::chrono::duration_cast<Time>(std::chrono::steady_clock::now().time_since_epoch()); }

double seconds(Time t) { return std::chrono::duration<double>(t).count(); }

Time stretched(Time time, double factor) { return std::chrono::duration_cast<Time>(time * factor); }

isotp::Options transport_options(const NodeOptions& o) {
  isotp::Options options;
  const profile::Bus& bus = o.diagnostics.profile->bus;
  options.address = {o.response_id,     o.request_id,     o.functional_id,    o.extended_ids,
                     bus.response_byte, bus.request_byte, bus.functional_byte};
  options.fd = o.fd;
  options.frame_bytes = o.fd ? can::max_fd_bytes : can::max_classic_bytes;
  options.max_message = 65535;
  options.padding_byte = o.diagnostics.profile->bus.padding;
  for (Time* time : {&options.n_as, &options.n_bs, &options.n_cr}) {
    *time = stretched(*time, o.patience);
  }
  return options;
}

uds::ServerTimings server_timings(const NodeOptions& o) {
  uds::ServerTimings timings;
  timings.s3 = stretched(timings.s3, o.patience);
  return timings;
}

}  // namespace

Expected<std::unique_ptr<BusNode>> BusNode::open(const NodeOptions& options, Instrument& instrument) {
  can::SocketOptions socket_options;
  socket_options.interface = options.interface;
  socket_options.fd = options.fd;
  for (const std::uint32_t id : {options.request_id, options.functional_id}) {
    can::Filter filter;
    filter.id = id;
    filter.extended = options.extended_ids;
    socket_options.filters.push_back(filter);
  }
  auto socket = can::Socket::open(socket_options);
  if (!socket) {
    return tl::unexpected(socket.error());
  }
  std::unique_ptr<BusNode> node(new BusNode(options, instrument, std::move(*socket)));
  node->socket_options_ = socket_options;
  return node;
}

BusNode::BusNode(const NodeOptions& options, Instrument& instrument, can::Socket socket)
    : options_(options),
      instrument_(instrument),
      diagnostics_(instrument, options.diagnostics),
      server_(transport_options(options), server_timings(options), diagnostics_),
      socket_(std::move(socket)),
      bus_(options.rates),
      turnaround_(options.turnaround_ms),
      faulty_(options.scenario) {
  if (!options.diagnostics.profile->stream.empty()) {
    instrument_.keep_stream();
  }
}

Time BusNode::ins_time() const { return std::chrono::duration_cast<Time>(std::chrono::duration<double>(now_s_)); }

void BusNode::reset(Time now) {
  instrument_.power_on(now_s_);
  diagnostics_.power_on(now);
  server_.reset();
}

void BusNode::lose_link(const Error& why) {
  fmt::print(stderr, "sim_ins: {}; trying again\n", why.message);
  socket_.reset();
  server_.reset();
}

void BusNode::try_reopen(Time now) {
  if (now < retry_at_) {
    return;
  }
  retry_at_ = now + 200ms;
  if (auto socket = can::Socket::open(socket_options_); socket) {
    socket_ = std::move(*socket);
    fmt::print(stderr, "sim_ins: {}: up again\n", options_.interface);
  }
}

void BusNode::receive(Time now) {
  while (socket_) {
    const auto frames = socket_->receive();
    if (!frames) {
      lose_link(frames.error());
      return;
    }
    if (frames->empty()) {
      return;
    }
    for (const can::ReceivedFrame& received : *frames) {
      if (received.event) {
        continue;
      }
      const double heard_s = turnaround_.heard(received.frame, now_s_, seconds(bus_.free_at()));
      now_s_ = transaction() ? heard_s : now_s_;
      bus_.transmit(received.frame, ins_time());
      tester_heard_ = now;
      if (instrument_.ready() && !acts(FaultKind::bus_off)) {  // nobody listens while the INS starts
        server_.on_frame(received.frame, now);
      }
    }
  }
}

double BusNode::longest_step() const {
  if (transaction()) {
    return longest_step_in_upload_s;
  }
  return options_.speed > 1.0 ? std::min(longest_step_s, longest_compressed_step_s * options_.speed) : longest_step_s;
}

void BusNode::advance_clock(Time now) {
  const double real_step = seconds(now - real_before_);
  real_before_ = now;
  step_began_ = ins_time();
  const bool testers_turn = transaction() && !more_to_send_ && now - tester_heard_ < patience;
  if (!testers_turn) {
    now_s_ += std::min(options_.speed * real_step, longest_step());
  }
  if (const Fault* refusal = options_.scenario.active(FaultKind::nrc, now_s_)) {
    diagnostics_.answer_all_with(static_cast<uds::Nrc>(static_cast<std::uint8_t>(refusal->value)));
  } else {
    diagnostics_.answer_all_with(std::nullopt);
  }
  diagnostics_.set_instrument_time(now_s_);
  instrument_.advance(now_s_);
  if (const auto answer = diagnostics_.take_answer()) {
    server_.respond(*answer, now);
  }
  note_state();
  reset_on_demand(now);
}

void BusNode::note_state() {
  options_.scenario.note_state(instrument_.state(), now_s_);
  faulty_.note_state(instrument_.state(), now_s_);
}

// Each reset of the scenario happens once.
void BusNode::reset_on_demand(Time now) {
  std::vector<Fault>& faults = options_.scenario.faults;
  const auto due = std::find_if(faults.begin(), faults.end(), [this](const Fault& fault) {
    return fault.kind == FaultKind::reset && !fault.state && now_s_ >= fault.at_s;
  });
  if (due == faults.end()) {
    return;
  }
  faults.erase(due);
  faulty_.count(FaultKind::reset);
  fmt::print(stderr, "sim_ins: reset on demand at {:.3f} s, {}\n", now_s_, ins::name(instrument_.state()));
  reset(now);
}

void BusNode::queue_status() {
  if (!options_.tells_status || now_s_ < next_status_s_) {
    return;
  }
  next_status_s_ = now_s_ + std::max(status_interval_s, least_real_interval_s * options_.speed);
  ins::Status status = instrument_.status();
  status.unlocked = diagnostics_.unlocked();
  status.session = static_cast<std::uint8_t>(diagnostics_.session());
  if (acts(FaultKind::late_status)) {
    faulty_.count(FaultKind::late_status);
    return;
  }
  if (acts(FaultKind::wrong_status)) {
    faulty_.count(FaultKind::wrong_status);
    status.state = ins::State::idle;
  }
  const auto frames =
      profile::encode_status(*options_.diagnostics.profile, status, alive_, options_.status_id, options_.extended_ids);
  status_frames_.assign(frames.begin(), frames.end());
  ++alive_;
}

// Frames as the faulty bus passes them on. False where the kernel's queue is full or the link is gone.
bool BusNode::put_on_bus(std::span<const can::CanFrame> frames) {
  if (options_.scenario.faults.empty()) {
    return send_all(frames);
  }
  spoilt_.clear();
  for (const can::CanFrame& frame : frames) {
    faulty_.pass(frame, now_s_, spoilt_);
  }
  return send_all(spoilt_);
}

bool BusNode::send_all(std::span<const can::CanFrame> frames) {
  std::size_t done = 0;
  while (socket_ && done < frames.size()) {
    const auto sent = socket_->send(frames.subspan(done));
    if (!sent) {
      lose_link(sent.error());
      return false;
    }
    done += *sent;
    if (done < frames.size()) {  // the queue is full: wait for the kernel, the INS's clock stands meanwhile
      pollfd waiting{socket_->fd(), POLLOUT, 0};
      ::poll(&waiting, 1, 1);
    }
  }
  return socket_.has_value();
}

// Somebody else who asks for the serial number; the INS cannot tell the two apart.
void BusNode::hear_second_tester(Time now) {
  const Fault* intruder = options_.scenario.active(FaultKind::second_tester, now_s_);
  if (intruder == nullptr || intruder->value <= 0.0 || now_s_ < next_intrusion_s_ || !socket_) {
    return;
  }
  next_intrusion_s_ = now_s_ + 1.0 / intruder->value;
  can::CanFrame request;
  request.id = options_.request_id;
  request.extended = options_.extended_ids;
  request.size = 8;
  const std::uint16_t serial = options_.diagnostics.profile->serial;
  request.data = {0x03, 0x22, static_cast<std::uint8_t>(serial >> 8U), static_cast<std::uint8_t>(serial)};
  faulty_.count(FaultKind::second_tester);
  bus_.transmit(request, ins_time());
  if (send_all({&request, 1}) && instrument_.ready()) {
    server_.on_frame(request, now);
  }
}

// What the bus can carry up to now: a frame starts when the one before has ended.
void BusNode::transmit(Time now) {
  if (!socket_) {
    status_frames_.clear();
    return;
  }
  const Time until = ins_time();
  if (!options_.scenario.faults.empty()) {
    spoilt_.clear();
    faulty_.flush(now_s_, spoilt_);
    for (const can::CanFrame& frame : spoilt_) {
      bus_.transmit(frame, until);
    }
    if (!send_all(spoilt_)) {
      return;
    }
  }
  // Before any answer of this turn: it may say that the rotation is over.
  for (const ImuSample& sample : instrument_.take_stream()) {
    const std::uint64_t counter = stream_counter_++;
    if (!sample.missing && !acts(FaultKind::bus_off)) {
      append_sample(*options_.diagnostics.profile, sample, counter, stream_frames_);
    }
  }
  for (const can::CanFrame& frame : stream_frames_) {
    bus_.transmit(frame, until);
  }
  if (!stream_frames_.empty() && !put_on_bus(std::exchange(stream_frames_, {}))) {
    return;
  }
  for (const can::CanFrame& frame : status_frames_) {
    bus_.transmit(frame, until);
  }
  if (!status_frames_.empty() && !put_on_bus(status_frames_)) {
    return;
  }
  status_frames_.clear();
  std::array<can::CanFrame, frames_per_call> frames;
  more_to_send_ = false;
  while (true) {
    const std::size_t offered = server_.pending(frames, now);
    std::size_t fits = 0;
    while (fits < offered && bus_.free_at() <= until) {
      // Waiting since the bus was free, or since the clock's last step began.
      bus_.transmit(frames[fits], std::max(bus_.free_at(), step_began_));
      ++fits;
    }
    if (fits > 0 && !put_on_bus(std::span(frames).first(fits))) {
      return;
    }
    if (fits > 0) {
      server_.sent(fits, now);
      turnaround_.answer_sent();
    }
    if (fits < offered) {
      more_to_send_ = true;
      return;
    }
    if (offered == 0) {
      return;
    }
  }
}

void BusNode::tell_progress() {
  const auto stopped = instrument_.gimbal_stopped_at_s();
  if (!stopped) {
    stop_told_ = upload_told_ = false;
    return;
  }
  if (!stop_told_) {
    stop_told_ = true;
    fmt::print(stderr, "sim_ins: gimbal stopped at {:.3f} s, {} pages written, {} uploaded\n", *stopped,
               instrument_.raw().pages_written(), diagnostics_.pages_served());
  }
  if (!upload_told_ && diagnostics_.pages_served() == instrument_.raw().pages_written() && !more_to_send_) {
    upload_told_ = true;
    fmt::print(stderr, "sim_ins: last page uploaded {:.3f} s after the gimbal stopped; bus {:.1f} % busy so far\n",
               std::max(0.0, seconds(bus_.free_at()) - *stopped), 100.0 * seconds(bus_.busy()) / now_s_);
  }
}

int BusNode::sleep_ms() const {
  if (more_to_send_) {
    return 0;
  }
  if (transaction() || !server_.idle() || faulty_.holds_frames() || instrument_.flash().busy()) {
    return short_sleep_ms;
  }
  const double until_status_ms = (next_status_s_ - now_s_) / options_.speed * 1000.0;
  return static_cast<int>(std::clamp<double>(until_status_ms, short_sleep_ms, long_sleep_ms));
}

void BusNode::run(const volatile int& stop) {
  real_before_ = real_now();
  reset(real_before_);
  while (stop == 0) {
    const Time now = real_now();
    if (!socket_) {
      try_reopen(now);
    }
    receive(now);
    server_.run_session_timer(diagnostics_.session_timer_wanted(), now);
    server_.on_time(now);
    advance_clock(now);
    hear_second_tester(now);
    queue_status();
    transmit(now);
    tell_progress();
    if (diagnostics_.take_reset_request()) {
      reset_pending_ = true;
    }
    if (reset_pending_ && server_.idle()) {
      reset_pending_ = false;
      reset(now);
    }
    pollfd waiting{socket_ ? socket_->fd() : -1, POLLIN, 0};
    if (more_to_send_) {
      ::sched_yield();  // on one processor the tester takes what it was sent, instead of the queue filling up
    }
    ::poll(&waiting, 1, sleep_ms());
  }
  const std::string acted = faulty_.tally();
  fmt::print(stderr, "sim_ins: switched off at {:.3f} s; faults of the bus that acted: {}\n", now_s_,
             acted.empty() ? "none" : acted);
}

}  // namespace selfcal::sim
