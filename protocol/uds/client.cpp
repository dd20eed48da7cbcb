#include "protocol/uds/client.hpp"

#include <algorithm>
#include <array>

namespace selfcal::uds {
namespace {

// Bytes after the service that a positive response repeats and that say what it is about: the identifier of a record, and
// of a routine behind its sub-function.
std::size_t identifier_size(std::uint8_t service) {
  switch (service) {
    case service::read_data:
    case service::write_data: return 2;
    case service::routine_control: return 3;
    default: return 0;
  }
}

}  // namespace

Client::Client(const isotp::Options& options, const ClientTimings& timings) : transport_(options), timings_(timings) {}

bool Client::request(std::span<const std::uint8_t> message, Time now) {
  if (waiting_ || !transport_.send(message, now)) {
    return false;
  }
  waiting_ = true;
  service_ = message[0];
  answered_by_size_ = std::min(message.size(), 1 + identifier_size(service_));
  std::copy_n(message.begin(), answered_by_size_, answered_by_.begin());
  answered_by_[0] = static_cast<std::uint8_t>(service_ + positive_offset);
  deadline_.reset();
  pending_until_.reset();
  return true;
}

void Client::cancel() {
  waiting_ = false;
  deadline_.reset();
  transport_.reset();
}

void Client::keep_session(bool keep, Time now) {
  next_tester_present_.reset();
  if (keep) {
    next_tester_present_ = now + timings_.tester_present;
  }
}

std::optional<Outcome> Client::on_frame(const can::CanFrame& frame, Time now) {
  return handle(transport_.on_frame(frame, now), now);
}

std::optional<Outcome> Client::sent(std::size_t count, Time now) { return handle(transport_.sent(count, now), now); }

std::optional<Outcome> Client::on_time(Time now) {
  if (next_tester_present_ && now >= *next_tester_present_) {
    static constexpr std::array<std::uint8_t, 2> tester_present = {service::tester_present, suppress_response_bit};
    // If the last one still waits for the bus, it will do: it is this one's equal.
    static_cast<void>(transport_.send_functional(tester_present, now));
    next_tester_present_ = now + timings_.tester_present;
  }
  if (auto outcome = handle(transport_.on_time(now), now)) {
    return outcome;
  }
  if (waiting_ && deadline_ && now >= *deadline_) {
    return finish({Outcome::Kind::timeout, {}, 0, isotp::Result::sent});
  }
  return std::nullopt;
}

std::optional<Outcome> Client::handle(const isotp::Events& events, Time now) {
  for (const isotp::Result result : events) {
    if (!waiting_) {
      return std::nullopt;
    }
    switch (result) {
      case isotp::Result::sent: deadline_ = now + timings_.p2; break;
      case isotp::Result::reception_started:
        deadline_.reset();  // N_Cr watches from here on
        break;
      case isotp::Result::received:
        if (auto outcome = judge_message(now)) {
          return outcome;
        }
        break;
      case isotp::Result::received_functional:  // another tester speaks
      case isotp::Result::unexpected_frame:     // the message that displaced the old one may be the answer
        break;
      default: return finish({Outcome::Kind::transport, {}, 0, result});
    }
  }
  return std::nullopt;
}

// Whatever does not answer the request under way is the late answer to one that was given up, or the answer to another
// tester with the same identifiers: passed over.
std::optional<Outcome> Client::judge_message(Time now) {
  const auto message = transport_.message();
  const std::size_t compared = std::min(message.size(), answered_by_size_);
  if (std::equal(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(compared), answered_by_.begin())) {
    return finish({Outcome::Kind::positive, message, 0, isotp::Result::received});
  }
  if (!deadline_ && !transport_.sending()) {
    deadline_ = now + timings_.p2;  // the stranger was a long message, which had stopped the clock
  }
  if (message[0] != service::negative_response || message.size() < 2 || message[1] != service_) {
    return std::nullopt;
  }
  if (message.size() != 3) {
    return finish({Outcome::Kind::malformed, message, 0, isotp::Result::received});
  }
  if (message[2] != static_cast<std::uint8_t>(Nrc::response_pending)) {
    return finish({Outcome::Kind::negative, message, message[2], isotp::Result::received});
  }
  pending_until_ = pending_until_.value_or(now + timings_.pending_limit);
  deadline_ = std::min(now + timings_.p2_star, *pending_until_);
  return std::nullopt;
}

Outcome Client::finish(Outcome outcome) {
  waiting_ = false;
  deadline_.reset();
  pending_until_.reset();
  return outcome;
}

std::optional<Time> Client::next_deadline() const {
  std::optional<Time> earliest = transport_.next_deadline();
  for (const auto& candidate : {deadline_, next_tester_present_}) {
    if (candidate && (!earliest || *candidate < *earliest)) {
      earliest = candidate;
    }
  }
  return earliest;
}

}  // namespace selfcal::uds
