#include "protocol/uds/server.hpp"

#include <algorithm>
#include <array>

namespace selfcal::uds {
namespace {

bool has_sub_function(std::uint8_t service) {
  return service == service::session_control || service == service::ecu_reset || service == service::security_access ||
         service == service::routine_control || service == service::tester_present;
}

// ISO 14229-1, 7.5.3: a functional request gets no answer that says "not I".
bool silent_when_functional(std::uint8_t nrc) {
  switch (static_cast<Nrc>(nrc)) {
    case Nrc::service_not_supported:
    case Nrc::sub_function_not_supported:
    case Nrc::request_out_of_range:
    case Nrc::sub_function_not_supported_in_session:
    case Nrc::service_not_supported_in_session: return true;
    default: return false;
  }
}

}  // namespace

Server::Server(const isotp::Options& options, const ServerTimings& timings, RequestHandler& handler)
    : transport_(options), timings_(timings), handler_(handler) {
  request_.reserve(options.max_message);
  response_.reserve(options.max_message);
  queued_.reserve(options.max_message);
}

void Server::on_frame(const can::CanFrame& frame, Time now) { handle(transport_.on_frame(frame, now), now); }

void Server::sent(std::size_t count, Time now) { handle(transport_.sent(count, now), now); }

void Server::handle(const isotp::Events& events, Time now) {
  for (const isotp::Result result : events) {
    if (session_until_) {
      session_until_ = now + timings_.s3;
    }
    if (result == isotp::Result::received || result == isotp::Result::received_functional) {
      take_request(result == isotp::Result::received_functional, now);
    } else if (result == isotp::Result::sent && !queued_.empty()) {
      static_cast<void>(transport_.send(queued_, now));  // just became free, and the length was checked
      queued_.clear();
    } else if (isotp::is_failure(result) && isotp::concerns_sending(result)) {
      queued_.clear();  // the tester is gone or deaf; it will ask again
    }
  }
}

void Server::take_request(bool functional, Time now) {
  const auto message = transport_.message();
  static constexpr std::array<std::uint8_t, 2> keep_alive = {service::tester_present, suppress_response_bit};
  if (std::ranges::equal(message, keep_alive) || !idle()) {
    return;  // the session timer was renewed; and of a second request beside the first one the client hears nothing
  }
  request_.assign(message.begin(), message.end());
  functional_ = functional;
  told_pending_ = false;
  suppress_ = has_sub_function(request_[0]) && request_.size() > 1 && (request_[1] & suppress_response_bit) != 0;
  if (suppress_) {
    request_[1] = static_cast<std::uint8_t>(request_[1] & ~suppress_response_bit);
  }
  response_.clear();
  if (handler_.handle(request_, response_, now) == RequestHandler::Answer::now) {
    deliver(response_, now);
    return;
  }
  later_ = true;
  pending_at_ = now + timings_.p2 / 2;  // well before the tester loses patience
}

void Server::respond(std::span<const std::uint8_t> response, Time now) {
  if (!later_) {
    return;  // a reset came between
  }
  later_ = false;
  pending_at_.reset();
  deliver(response, now);
}

void Server::deliver(std::span<const std::uint8_t> response, Time now) {
  if (response.empty()) {
    return;
  }
  const bool negative = response[0] == service::negative_response;
  const bool silent = negative ? functional_ && response.size() > 2 && silent_when_functional(response[2]) : suppress_;
  if (silent && !told_pending_) {
    return;
  }
  if (response.size() > transport_.options().max_message) {
    deliver(negative_response(request_[0], Nrc::response_too_long), now);
    return;
  }
  if (!transport_.send(response, now)) {
    queued_.assign(response.begin(), response.end());  // response-pending is still on its way out
  }
}

void Server::on_time(Time now) {
  handle(transport_.on_time(now), now);
  if (later_ && pending_at_ && now >= *pending_at_) {
    const auto pending_response = negative_response(request_[0], Nrc::response_pending);
    if (transport_.send(pending_response, now)) {
      told_pending_ = true;
    }
    pending_at_ = now + timings_.p2_star / 2;
  }
  if (session_until_ && now >= *session_until_) {
    if (!idle() || transport_.receiving()) {
      session_until_ = now + timings_.s3;
      return;
    }
    session_until_.reset();
    handler_.session_expired(now);
  }
}

std::optional<Time> Server::next_deadline() const {
  std::optional<Time> earliest = transport_.next_deadline();
  for (const auto& candidate : {pending_at_, session_until_}) {
    if (candidate && (!earliest || *candidate < *earliest)) {
      earliest = candidate;
    }
  }
  return earliest;
}

void Server::run_session_timer(bool run, Time now) {
  if (!run) {
    session_until_.reset();
  } else if (!session_until_) {  // whoever asks again and again must not wind it up
    session_until_ = now + timings_.s3;
  }
}

void Server::reset() {
  transport_.reset();
  queued_.clear();
  later_ = false;
  pending_at_.reset();
  session_until_.reset();
}

}  // namespace selfcal::uds
