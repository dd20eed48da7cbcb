// The tester's side of UDS over ISO-TP, without I/O: one request at a time, P2 and P2* with response-pending,
// TesterPresent on the functional identifier while a session is to be kept.
//
// Answers are matched with requests: a positive response by service and identifier. A negative response repeats only the
// service. One that equals the refusal of an earlier request with another identifier may be a second copy of it: it is held
// until P2 is over, and is the outcome only if no other answer came.
//
// Drive it as isotp::Transport: on_frame / on_time / pending / sent / next_deadline.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "protocol/isotp/transport.hpp"
#include "protocol/uds/messages.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal::uds {

// How long the client waits. The server states its own P2 and P2* in the answer to DiagnosticSessionControl.
struct ClientTimings {
  Time p2 = std::chrono::milliseconds(150);       // to the first frame of the answer, bus delay included
  Time p2_star = std::chrono::seconds(5);         // the same after response-pending
  Time pending_limit = std::chrono::seconds(60);  // of response-pending altogether
  Time tester_present = std::chrono::seconds(2);  // interval; S3 of the server is 5 s
};

// `configured`, lengthened where the server states that it takes longer: P2 up to 10 s and P2* up to 30 s, with 0.1 s for
// the way over the bus. Beyond that, and where 0 is stated, `configured` stays as it is.
ClientTimings with_stated(ClientTimings configured, const SessionTimings& stated);

// What became of the request. Exactly one outcome comes of each request that is not cancelled.
struct Outcome {
  enum class Kind : std::uint8_t {
    positive,   // response: whole message, service + 0x40 first
    negative,   // nrc
    timeout,    // nothing within P2 or P2*
    transport,  // ISO-TP failed: why
    too_long,   // the response announces more than was allowed for: announced
    malformed,  // an answer to something else, or no answer at all
  };
  Kind kind = Kind::positive;
  std::span<const std::uint8_t> response{};  // valid until the next on_frame()
  std::uint8_t nrc = 0;
  isotp::Result why = isotp::Result::sent;
  std::uint32_t announced = 0;  // bytes
  unsigned passed_over = 0;     // messages that came meanwhile and answer something else
};

class Client {
 public:
  Client(const isotp::Options& options, const ClientTimings& timings);

  // False when a request is under way or the message cannot be sent. A response of more than `longest_answer` bytes is
  // not received: outcome too_long.
  [[nodiscard]] bool request(std::span<const std::uint8_t> message, Time now,
                             std::size_t longest_answer = isotp::Options{}.max_message);
  bool busy() const { return waiting_; }
  void cancel();                           // forget the request and drop what is under way; a late answer is ignored
  void keep_session(bool keep, Time now);  // TesterPresent, response suppressed
  void set_timings(const ClientTimings& timings) { timings_ = timings; }
  const ClientTimings& timings() const { return timings_; }

  bool accepts(const can::CanFrame& frame) const { return transport_.accepts(frame); }
  std::optional<Outcome> on_frame(const can::CanFrame& frame, Time now);
  std::optional<Outcome> on_time(Time now);
  std::size_t pending(std::span<can::CanFrame> out, Time now) const { return transport_.pending(out, now); }
  std::optional<Outcome> sent(std::size_t count, Time now);
  std::optional<Time> next_deadline() const;
  std::optional<Time> next_transmission() const { return transport_.next_transmission(); }

 private:
  std::optional<Outcome> handle(const isotp::Events& events, Time now);
  std::optional<Outcome> judge_message(Time now);
  std::optional<Outcome> judge_refusal(std::uint8_t nrc);
  bool may_be_a_copy(std::uint8_t nrc) const;
  Outcome refused();
  bool answers_request(std::span<const std::uint8_t> message) const;
  std::optional<Outcome> judge_announcement(Time now);
  Outcome finish(Outcome outcome);

  // How the positive response to a request begins: service and identifier. It tells one request from another.
  struct Answer {
    std::array<std::uint8_t, 4> bytes{};
    std::size_t size = 0;
    bool operator==(const Answer&) const = default;
  };
  // The last refusal of a service. A negative response names the service and not the identifier, so that a second copy
  // of it could pass for the answer to the next request of that service.
  struct Refusal {
    Answer request;
    std::uint8_t nrc = 0;
  };

  isotp::Transport transport_;
  ClientTimings timings_;
  bool waiting_ = false;
  std::uint8_t service_ = 0;
  Answer answered_by_;
  std::map<std::uint8_t, Refusal> refusals_;  // by service
  std::optional<std::uint8_t> held_nrc_;      // of a refusal of the present request, which may be a copy
  std::array<std::uint8_t, 3> refusal_message_{};
  std::size_t longest_answer_ = 0;
  unsigned passed_over_ = 0;
  std::optional<Time> deadline_;       // P2 or P2*, runs while nothing is being received
  std::optional<Time> pending_until_;  // no more response-pending after this
  std::optional<Time> next_tester_present_;
};

}  // namespace selfcal::uds
