#include "daemon/ins/can_port.hpp"

#include <fmt/format.h>
#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <utility>

#include "daemon/host/journal.hpp"
#include "protocol/profile/status_frames.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t frames_per_send = 64;
// Batches taken in one turn of the loop, so that one busy bus does not starve the others.
constexpr int batches_per_turn = 16;
constexpr auto full_queue_retry = 1ms;  // ENOBUFS has no event

isotp::Options transport_options(const InsConfig& config) {
  isotp::Options options;
  const profile::Bus& bus = config.profile->bus;
  options.address = {config.request_id, config.response_id, config.functional_id, config.extended_ids,
                     bus.request_byte,  bus.response_byte,  bus.functional_byte};
  options.fd = config.fd;
  options.frame_bytes = config.fd ? can::max_fd_bytes : can::max_classic_bytes;
  options.padding_byte = config.profile->bus.padding;
  options.block_size = config.profile->bus.block_size;
  options.st_min = config.profile->bus.st_min;
  return options;
}

uds::ClientTimings timings(const InsConfig& config) {
  uds::ClientTimings timings;
  timings.p2 = std::chrono::nanoseconds(static_cast<std::int64_t>(config.request_timeout_s * 1e9));
  const auto seconds = [](double s) { return std::chrono::nanoseconds(static_cast<std::int64_t>(s * 1e9)); };
  timings.p2_star = seconds(config.profile->timing.p2_star_s);
  timings.tester_present = seconds(config.profile->timing.tester_present_s);
  const profile::Timing& may = config.profile->timing;  // what takes longer is told by response-pending
  timings.pending_limit = std::max(timings.pending_limit, seconds(std::max({may.erase_s, may.write_s, may.commit_s})));
  return timings;
}

}  // namespace

CanPort::CanPort(EventLoop& loop, const InsConfig& config)
    : loop_(loop), config_(config), client_(transport_options(config), timings(config)) {
  open();
}

CanPort::~CanPort() {
  loop_.cancel(timer_);
  loop_.cancel(answer_timer_);
}

void CanPort::open() {
  can::SocketOptions options;
  options.interface = config_.interface;
  options.fd = config_.fd;
  constexpr std::uint32_t exact = 0x1FFFFFFF;
  options.filters.push_back({config_.response_id, exact, config_.extended_ids});
  if (config_.status_id) {
    options.filters.push_back({*config_.status_id, exact, config_.extended_ids});
    options.filters.push_back({*config_.status_id + 1, exact, config_.extended_ids});
  }
  auto socket = can::Socket::open(options);
  if (!socket) {
    return down(socket.error());
  }
  socket_ = std::move(*socket);
  if (socket_->receive_buffer_granted() < options.receive_buffer_bytes && !std::exchange(small_buffer_said_, true)) {
    journal::write(
        journal::Level::info,
        fmt::format("{}: a receive buffer of {} bytes is granted, {} were asked for (net.core.rmem_max): frames "
                    "may be lost while the machine is busy",
                    config_.interface, socket_->receive_buffer_granted(), options.receive_buffer_bytes));
  }
  trouble_.clear();
  io_ = std::make_unique<EventLoop::Io>(loop_, socket_->fd(), EPOLLIN, [this](unsigned) { on_readable(); });
  schedule();
}

void CanPort::down(const Error& error) {
  trouble_ = error.message;
  // The watch goes with the next reopening: it may be what called us. Without events it is silent.
  if (io_) {
    io_->want(0);
  }
  client_.cancel();
  client_.keep_session(false, loop_.now());
  if (done_) {
    answer(tl::unexpected(link_error(trouble_)));
  }
}

void CanPort::reopen() {
  if (receiving_) {
    reopen_wanted_ = true;
    return;
  }
  reopen_wanted_ = false;
  io_.reset();
  if (socket_) {
    lost_before_ += socket_->lost_frames();
  }
  socket_.reset();
  client_.cancel();
  client_.keep_session(false, loop_.now());
  if (done_) {
    answer(tl::unexpected(link_error("connection opened anew")));
  }
  open();
}

std::uint64_t CanPort::lost_frames() const { return lost_before_ + (socket_ ? socket_->lost_frames() : 0); }

void CanPort::keep_session(bool keep) {
  client_.keep_session(keep && trouble_.empty(), loop_.now());
  schedule();
}

void CanPort::take_timings(const uds::SessionTimings& stated) {
  client_.set_timings(uds::with_stated(timings(config_), stated));
}

void CanPort::request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
                      std::function<void(Answer<Bytes>)> done) {
  done_ = std::move(done);
  service_ = payload.front();
  longest_answer_ = longest_answer;
  if (!trouble_.empty()) {
    return answer(tl::unexpected(link_error(trouble_)));
  }
  if (!client_.request(payload, loop_.now(), longest_answer)) {
    return answer(tl::unexpected(
        PortError{PortError::Kind::protocol, 0,
                  fmt::format("{}: a request of {} bytes cannot be sent", config_.interface, payload.size())}));
  }
  if (!receiving_) {
    pump();
  }
}

void CanPort::cancel() {
  client_.cancel();
  done_ = {};
  loop_.cancel(answer_timer_);
  answer_timer_ = 0;
}

// From the loop, never from inside request().
void CanPort::answer(Answer<Bytes> result) {
  loop_.cancel(answer_timer_);
  answer_timer_ = loop_.after(0ns, [this, result = std::move(result)]() mutable {
    answer_timer_ = 0;
    const auto done = std::exchange(done_, {});
    if (done) {
      done(std::move(result));
    }
  });
}

void CanPort::on_readable() {
  receiving_ = true;
  for (int i = 0; i < batches_per_turn && receive_batch(); ++i) {
  }
  receiving_ = false;
  if (reopen_wanted_) {
    return reopen();
  }
  pump();
}

// True: there may be more.
bool CanPort::receive_batch() {
  const auto batch = socket_->receive();
  if (!batch) {
    down(batch.error());
    return false;
  }
  bool status_news = false;
  const SteadyTime now = loop_.now();  // one reading of the clock for all frames of a system call
  for (const can::ReceivedFrame& received : *batch) {
    if (received.event) {
      if (on_bus_event) {
        on_bus_event(*received.event);
      }
      continue;
    }
    if (!client_.accepts(received.frame)) {
      take_status(received.frame, status_news);
    } else if (const auto outcome = client_.on_frame(received.frame, now)) {
      deliver(*outcome);
      if (reopen_wanted_ || !trouble_.empty()) {
        return false;
      }
    }
  }
  // The answer to a first frame is due at once: flow control waits for nobody.
  if (!batch->empty()) {
    pump();
  }
  if (status_news && on_status) {
    on_status(status_);
  }
  return !batch->empty() && trouble_.empty();
}

void CanPort::take_status(const can::CanFrame& frame, bool& news) {
  if (config_.status_id) {
    news = profile::apply_status(*config_.profile, frame, *config_.status_id, config_.extended_ids, status_) || news;
  }
}

void CanPort::pump() {
  if (!socket_ || !trouble_.empty()) {
    return;
  }
  std::array<can::CanFrame, frames_per_send> frames;
  while (true) {
    const SteadyTime now = loop_.now();
    const std::size_t count = client_.pending(frames, now);
    if (count == 0) {
      break;
    }
    const auto taken = socket_->send(std::span(frames).first(count));
    if (!taken) {
      return down(taken.error());
    }
    if (const auto outcome = client_.sent(*taken, now)) {
      deliver(*outcome);
    }
    if (*taken < count) {
      loop_.cancel(timer_);
      timer_ = loop_.after(full_queue_retry, [this] { on_deadline(); });
      return;
    }
  }
  schedule();
}

void CanPort::schedule() {
  loop_.cancel(timer_);
  timer_ = 0;
  const auto deadline = client_.next_deadline();
  if (!deadline) {
    return;
  }
  timer_ = loop_.after(std::max(*deadline - loop_.now(), SteadyTime(0)), [this] { on_deadline(); });
}

void CanPort::on_deadline() {
  timer_ = 0;
  if (!trouble_.empty()) {
    return;
  }
  if (const auto outcome = client_.on_time(loop_.now())) {
    deliver(*outcome);
  }
  pump();
}

void CanPort::deliver(const uds::Outcome& outcome) {
  const auto done = std::exchange(done_, {});
  if (!done) {
    return;
  }
  if (outcome.kind == uds::Outcome::Kind::positive) {
    listener_.reset();
    return done(Bytes(outcome.response.begin(), outcome.response.end()));
  }
  done(tl::unexpected(explain(outcome)));
}

PortError CanPort::link_error(const std::string& what) const {
  const bool named = what.find(config_.interface) != std::string::npos;
  return {PortError::Kind::link, 0, named ? what : fmt::format("{}: {}", config_.interface, what)};
}

// From the second one in a row on with what was heard on the bus in between.
std::string CanPort::no_answer(const uds::Outcome& outcome) {
  std::string text = fmt::format("no answer to {} within {} s", uds::service_name(service_),
                                 std::chrono::duration<double>(client_.timings().p2).count());
  if (outcome.passed_over > 0) {
    text += fmt::format(" ({} answers to other requests came)", outcome.passed_over);
  }
  if (!listener_) {
    listener_.emplace(config_);
    return text;
  }
  const std::string why = listener_->why_silent();
  return why.empty() ? text : fmt::format("{}: {}", text, why);
}

PortError CanPort::explain(const uds::Outcome& outcome) {
  const std::string_view service = uds::service_name(service_);
  switch (outcome.kind) {
    case uds::Outcome::Kind::negative:
      return {PortError::Kind::negative, outcome.nrc,
              fmt::format("{}: INS refused {}: {}", config_.interface, service, uds::describe_nrc(outcome.nrc))};
    case uds::Outcome::Kind::timeout: return link_error(no_answer(outcome));
    case uds::Outcome::Kind::too_long:
      return {PortError::Kind::protocol, 0,
              fmt::format("{}: the answer to {} announces {} bytes, {} are the most it can have", config_.interface,
                          service, outcome.announced, longest_answer_)};
    case uds::Outcome::Kind::transport:
      return link_error(fmt::format("{}: transfer broken off: {}", service, isotp::name(outcome.why)));
    default:
      return {PortError::Kind::protocol, 0, fmt::format("{}: malformed answer to {}", config_.interface, service)};
  }
}

}  // namespace selfcal
