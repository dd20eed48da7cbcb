#include "daemon/ins/stream_port.hpp"

#include <fmt/format.h>
#include <sys/epoll.h>

#include <utility>

#include "daemon/ins/pass_events.hpp"
#include "protocol/profile/records.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto silence_limit = 5s;  // of the stream, while it is to come
constexpr auto first_limit = 60s;   // before its first sample: the gimbal goes to the first position
constexpr int batches_per_turn = 16;

// The identifier that a record is read or written by.
std::uint16_t number_in(std::span<const std::uint8_t> payload) {
  return static_cast<std::uint16_t>(payload.size() >= 3 ? payload[1] << 8U | payload[2] : 0);
}

}  // namespace

StreamPort::StreamPort(EventLoop& loop, std::unique_ptr<InsPort> ins, const InsConfig& config)
    : loop_(loop), ins_(std::move(ins)), config_(config), stream_(config.profile) {
  pass_events(*ins_, *this);
  const auto& given = config_.profile->sample_format.given;
  if (const auto rate = given.find("sample_rate"); rate != given.end()) {
    sample_rate_hz_ = rate->second;
  }
  open();
}

StreamPort::~StreamPort() {
  loop_.cancel(answer_timer_);
  loop_.cancel(stream_timer_);
}

void StreamPort::open() {
  can::SocketOptions options;
  options.interface = config_.interface;
  options.fd = config_.profile->bus.fd;
  for (const profile::Frame& frame : config_.profile->stream) {
    options.filters.push_back({frame.id, 0x1FFFFFFF, config_.profile->bus.extended_ids});
  }
  auto socket = can::Socket::open(options);
  if (!socket) {
    trouble_ = socket.error().message;
    return;
  }
  socket_ = std::move(*socket);
  trouble_.clear();
  io_ = std::make_unique<EventLoop::Io>(loop_, socket_->fd(), EPOLLIN, [this](unsigned) { on_readable(); });
}

void StreamPort::reopen() {
  io_.reset();
  lost_before_ += socket_ ? socket_->lost_frames() : 0;
  socket_.reset();
  if (turning_ && broken_.empty()) {
    broken_ = "the connection was opened anew";
    stream_.end();
  }
  ins_->reopen();
  open();
}

std::uint64_t StreamPort::lost_frames() const {
  return ins_->lost_frames() + lost_before_ + (socket_ ? socket_->lost_frames() : 0);
}

// --- the stream

void StreamPort::on_readable() {
  for (int batch = 0; batch < batches_per_turn && socket_; ++batch) {
    const auto received = socket_->receive();
    if (!received) {
      trouble_ = received.error().message;
      io_->want(0);  // the watch goes with the next reopening: it may be what called us
      return;
    }
    for (const can::ReceivedFrame& one : *received) {
      const bool wide = one.frame.extended;
      if (!one.event && !one.frame.remote && wide == config_.profile->bus.extended_ids) {
        stream_.take(one.frame);
      }
    }
    if (received->empty()) {
      break;
    }
  }
  if (turning_ && broken_.empty()) {
    broken_ = stream_.trouble();
  }
}

// What came before the answer in hand belongs before it. The kernel's queue has an end, and so has this.
void StreamPort::drain() {
  constexpr int turns = 64;
  for (int turn = 0; turn < turns && socket_ && trouble_.empty(); ++turn) {
    const std::uint64_t before = stream_.samples();
    on_readable();
    if (stream_.samples() == before) {
      return;
    }
  }
}

void StreamPort::begin(std::span<const std::uint8_t> option) {
  const auto run_id = profile::read_rotation_start(*config_.profile, option);
  run_id_ = run_id.value_or(0);
  turning_ = run_id_ != 0;
  broken_.clear();
  stream_.begin();
  watch();
}

void StreamPort::watch() {
  samples_seen_ = stream_.samples();
  const auto limit = samples_seen_ == 0 ? first_limit : silence_limit;
  loop_.cancel(stream_timer_);
  stream_timer_ = loop_.after(limit, [this, limit] {
    stream_timer_ = 0;
    if (!turning_ || !broken_.empty()) {
      return;
    }
    if (stream_.samples() == samples_seen_) {
      broken_ = fmt::format("no sample came for {} s behind sample {}", std::chrono::duration<double>(limit).count(),
                            samples_seen_);
      return stream_.end();
    }
    watch();
  });
}

// --- requests

void StreamPort::request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
                         std::function<void(Answer<Bytes>)> done) {
  done_ = std::move(done);
  request_.assign(payload.begin(), payload.end());
  const profile::Profile& p = *config_.profile;
  const std::uint8_t service = payload.front();
  if (!trouble_.empty()) {
    return answer(trouble(PortError::Kind::link, trouble_));
  }
  if (service == uds::service::read_data && number_in(payload) == p.directory.did) {
    return answer(directory());
  }
  if (service == uds::service::read_memory) {
    return answer(memory(payload));
  }
  if (starts_rotation()) {
    begin(payload.subspan(4));  // its first sample may come before its answer
  }
  ins_->request(payload, longest_answer, [this](Answer<Bytes> told) {
    Answer<Bytes> passed = seen(std::move(told));
    if (const auto done_now = std::exchange(done_, {})) {
      done_now(std::move(passed));
    }
  });
}

void StreamPort::cancel() {
  done_ = {};
  loop_.cancel(std::exchange(answer_timer_, 0));
  ins_->cancel();
}

bool StreamPort::starts_rotation() const {
  const auto call = request_.front() == uds::service::routine_control ? uds::parse_routine_request(request_)
                                                                      : tl::unexpected(uds::Nrc::none);
  return call && call->routine == config_.profile->rotate.id && call->action == uds::RoutineAction::start;
}

Answer<Bytes> StreamPort::seen(Answer<Bytes> told) {
  const profile::Profile& p = *config_.profile;
  const std::uint8_t service = request_.front();
  const std::uint16_t number = number_in(request_);
  if (service == uds::service::read_data && number == p.state.did) {
    return state_seen(std::move(told));
  }
  if (!told) {
    if (starts_rotation() && told.error().kind == PortError::Kind::negative) {  // without an answer nobody knows
      turning_ = false;
      run_id_ = 0;
    }
    return told;
  }
  const auto record = std::span(std::as_const(*told)).subspan(std::min<std::size_t>(3, told->size()));
  if (service == uds::service::read_data && number == p.sample_format.did) {
    const auto format = profile::decode_sample_format(p, record);
    sample_rate_hz_ = format ? format->sample_rate_hz : sample_rate_hz_;
  } else if (service == uds::service::write_data && number == p.schedule.did) {
    const auto schedule = profile::decode_schedule(p, std::span(std::as_const(request_)).subspan(3));
    schedule_ = schedule ? std::optional(*schedule) : std::nullopt;
  }
  return told;
}

// The state is believed when all samples before it are taken.
Answer<Bytes> StreamPort::state_seen(Answer<Bytes> told) {
  if (!told || told->size() < 3) {
    return told;
  }
  drain();
  const auto state = profile::decode_state(*config_.profile, std::span(std::as_const(*told)).subspan(3));
  if (!state) {
    return told;
  }
  if (turning_ && state->run_id == run_id_ && state->state != ins::State::rotating) {
    turning_ = false;
    stream_.end();
  }
  return told;
}

std::uint32_t StreamPort::pages_written() const {  // the page that is being filled does not count
  return turning_ ? static_cast<std::uint32_t>(stream_.samples() / flash::samples_per_page) : stream_.pages_begun();
}

Answer<Bytes> StreamPort::directory() {
  drain();
  if (run_id_ == 0) {
    return trouble(PortError::Kind::protocol,
                   "the INS streams its samples, and the service kept none: it was started "
                   "after the rotation began");
  }
  if (!broken_.empty()) {  // the state goes through as it is, so that the gimbal is stopped
    return trouble(PortError::Kind::protocol, fmt::format("the samples are of no use: {}", broken_));
  }
  ins::DirectoryRecord record;
  record.run_id = run_id_;
  record.pages_written = pages_written();
  record.pages_expected = schedule_ ? pages_of(*schedule_, sample_rate_hz_) : record.pages_written;
  record.complete = !turning_;
  record.samples = record.complete ? stream_.samples() : std::uint64_t{record.pages_written} * flash::samples_per_page;
  return uds::read_response(profile::kept_directory, *profile::encode(*config_.profile, record));
}

Answer<Bytes> StreamPort::memory(std::span<const std::uint8_t> payload) const {
  auto told = stream_.memory(payload, pages_written(), run_id_, !turning_);
  if (told) {
    return std::move(*told);
  }
  const auto nrc = static_cast<std::uint8_t>(told.error());
  return tl::unexpected(PortError{PortError::Kind::negative, nrc,
                                  fmt::format("{}: kept samples: {}", config_.interface, uds::describe_nrc(nrc))});
}

// From the loop, never from inside request().
void StreamPort::answer(Answer<Bytes> result) {
  loop_.cancel(answer_timer_);
  answer_timer_ = loop_.after(0ns, [this, result = std::move(result)]() mutable {
    answer_timer_ = 0;
    if (const auto done = std::exchange(done_, {})) {
      done(std::move(result));
    }
  });
}

tl::unexpected<PortError> StreamPort::trouble(PortError::Kind kind, const std::string& what) const {
  const bool named = what.find(config_.interface) != std::string::npos;
  return tl::unexpected<PortError>(PortError{kind, 0, named ? what : fmt::format("{}: {}", config_.interface, what)});
}

}  // namespace selfcal
