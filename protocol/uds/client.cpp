#include "protocol/uds/client.hpp"

#include <algorithm>
#include <array>

namespace selfcal::uds {
namespace {

// Bytes after the service that a positive response repeats and that say what it is about: the sub-function, the block
// counter, the identifier of a record, and that of a routine behind its sub-function.
std::size_t identifier_size(std::uint8_t service) {
  switch (service) {
    case service::session_control:
    case service::ecu_reset:
    case service::security_access:
    case service::transfer_data:
    case service::file_transfer:
    case service::tester_present: return 1;
    case service::read_data:
    case service::write_data: return 2;
    case service::routine_control: return 3;
    default: return 0;
  }
}

constexpr Time bus_delay = std::chrono::milliseconds(100);
constexpr Time longest_p2 = std::chrono::seconds(10);
constexpr Time longest_p2_star = std::chrono::seconds(30);

Time with_stated(Time configured, Time stated, Time longest) {
  return stated > longest ? configured : std::max(configured, stated + bus_delay);
}

}  // namespace

ClientTimings with_stated(ClientTimings configured, const SessionTimings& stated) {
  configured.p2 = with_stated(configured.p2, stated.p2, longest_p2);
  configured.p2_star = with_stated(configured.p2_star, stated.p2_star, longest_p2_star);
  return configured;
}

Client::Client(const isotp::Options& options, const ClientTimings& timings) : transport_(options), timings_(timings) {}

bool Client::request(std::span<const std::uint8_t> message, Time now, std::size_t longest_answer) {
  if (waiting_ || !transport_.send(message, now)) {
    return false;
  }
  waiting_ = true;
  service_ = message[0];
  answered_by_ = {};
  answered_by_.size = std::min(message.size(), 1 + identifier_size(service_));
  std::copy_n(message.begin(), answered_by_.size, answered_by_.bytes.begin());
  answered_by_.bytes[0] = static_cast<std::uint8_t>(service_ + positive_offset);
  held_nrc_.reset();
  longest_answer_ = longest_answer;
  passed_over_ = 0;
  deadline_.reset();
  pending_until_.reset();
  return true;
}

void Client::cancel() {
  if (waiting_ && held_nrc_) {  // given up before it was clear: asked again, it is believed at once
    refusals_[service_] = {answered_by_, *held_nrc_};
  }
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
    return held_nrc_ ? refused() : finish({.kind = Outcome::Kind::timeout});
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
        if (transport_.announced() > longest_answer_) {
          if (auto outcome = judge_announcement(now)) {
            return outcome;
          }
        }
        break;
      case isotp::Result::message_too_long:
        if (auto outcome = judge_announcement(now)) {
          return outcome;
        }
        break;
      case isotp::Result::received:
        if (auto outcome = judge_message(now)) {
          return outcome;
        }
        break;
      case isotp::Result::received_functional:  // another tester speaks
      case isotp::Result::unexpected_frame:     // the message that displaced the old one may be the answer
        break;
      default: return finish({.kind = Outcome::Kind::transport, .why = result});
    }
  }
  return std::nullopt;
}

bool Client::answers_request(std::span<const std::uint8_t> message) const {
  const std::size_t compared = std::min(message.size(), answered_by_.size);
  return std::equal(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(compared),
                    answered_by_.bytes.begin());
}

// A message longer than the answer can be. Another tester's is its own affair.
std::optional<Outcome> Client::judge_announcement(Time now) {
  if (!answers_request(transport_.incoming())) {
    return std::nullopt;
  }
  transport_.refuse_incoming(now);
  return finish({.kind = Outcome::Kind::too_long, .announced = transport_.announced()});
}

// Whatever does not answer the request under way is the late or second answer to an earlier one, or the answer to
// another tester with the same identifiers: passed over.
std::optional<Outcome> Client::judge_message(Time now) {
  const auto message = transport_.message();
  if (answers_request(message)) {
    return finish({.kind = Outcome::Kind::positive, .response = message});
  }
  if (!deadline_ && !transport_.sending()) {
    deadline_ = now + timings_.p2;  // the stranger was a long message, which had stopped the clock
  }
  const bool refuses = message[0] == service::negative_response && message.size() >= 2 && message[1] == service_;
  if (!refuses || transport_.sending()) {  // what comes before the request is out answers an earlier one
    ++passed_over_;
    return std::nullopt;
  }
  if (message.size() != 3) {
    return finish({.kind = Outcome::Kind::malformed, .response = message});
  }
  if (message[2] != static_cast<std::uint8_t>(Nrc::response_pending)) {
    return judge_refusal(message[2]);
  }
  pending_until_ = pending_until_.value_or(now + timings_.pending_limit);
  deadline_ = std::min(now + timings_.p2_star, *pending_until_);
  return std::nullopt;
}

// The same service has refused another request for the same reason.
bool Client::may_be_a_copy(std::uint8_t nrc) const {
  const auto last = refusals_.find(service_);
  return last != refusals_.end() && last->second.nrc == nrc && last->second.request != answered_by_;
}

std::optional<Outcome> Client::judge_refusal(std::uint8_t nrc) {
  held_nrc_ = nrc;
  return may_be_a_copy(nrc) ? std::nullopt : std::optional(refused());
}

Outcome Client::refused() {
  refusals_[service_] = {answered_by_, *held_nrc_};
  refusal_message_ = {service::negative_response, service_, *held_nrc_};
  return finish({.kind = Outcome::Kind::negative, .response = refusal_message_, .nrc = *held_nrc_});
}

Outcome Client::finish(Outcome outcome) {
  outcome.passed_over = passed_over_;
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
