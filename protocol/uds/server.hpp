// The ECU's side of UDS over ISO-TP, without I/O: takes requests off the transport, hands them to a handler, sends what
// it answers. Sessions, locks and services are the handler's; the rules on when to keep silent, response-pending and the
// session time-out are here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/isotp/transport.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal::uds {

class RequestHandler {
 public:
  virtual ~RequestHandler() = default;

  enum class Answer : std::uint8_t {
    now,    // `response` holds the message, positive or negative
    later,  // Server::respond() will be called; response-pending is sent meanwhile
  };
  // request has at least one byte. `response` is empty, with capacity kept from call to call.
  virtual Answer handle(std::span<const std::uint8_t> request, Bytes& response, Time now) = 0;
  virtual void session_expired(Time now) = 0;  // no request for S3: back to the default session, locked
};

struct ServerTimings {
  Time p2 = std::chrono::milliseconds(50);
  Time p2_star = std::chrono::seconds(5);
  Time s3 = std::chrono::seconds(5);
};

class Server {
 public:
  Server(const isotp::Options& options, const ServerTimings& timings, RequestHandler& handler);

  bool accepts(const can::CanFrame& frame) const { return transport_.accepts(frame); }
  void on_frame(const can::CanFrame& frame, Time now);
  void on_time(Time now);
  std::size_t pending(std::span<can::CanFrame> out, Time now) const { return transport_.pending(out, now); }
  void sent(std::size_t count, Time now);
  std::optional<Time> next_deadline() const;
  std::optional<Time> next_transmission() const { return transport_.next_transmission(); }

  // The answer to a request for which the handler said `later`.
  void respond(std::span<const std::uint8_t> response, Time now);
  bool idle() const { return !later_ && !transport_.sending(); }  // everything is out: a reset may happen

  // On in every session but the default one; may be told over and over, only requests renew it.
  void run_session_timer(bool run, Time now);
  void reset();  // as after power-on

 private:
  void handle(const isotp::Events& events, Time now);
  void take_request(bool functional, Time now);
  void deliver(std::span<const std::uint8_t> response, Time now);

  isotp::Transport transport_;
  ServerTimings timings_;
  RequestHandler& handler_;
  Bytes request_;
  Bytes response_;
  Bytes queued_;  // an answer that waits until response-pending is out
  bool later_ = false;
  bool functional_ = false;         // how the request in hand came
  bool suppress_ = false;           // it asked for no positive response
  bool told_pending_ = false;       // response-pending was sent: the answer must be sent too
  std::optional<Time> pending_at_;  // next response-pending
  std::optional<Time> session_until_;
};

}  // namespace selfcal::uds
