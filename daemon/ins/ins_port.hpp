// How the calibration talks to one INS: a request and its answer, status frames, and nothing about sockets. The CAN
// socket stands behind it in the daemon, a fake INS in tests.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "protocol/can/bus_event.hpp"
#include "protocol/error.hpp"
#include "protocol/ins_interface/status.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal {

// Why a request has no positive answer.
struct PortError {
  enum class Kind {
    link,      // no answer, or the interface is down: worth trying again later
    negative,  // the INS refused, with nrc
    protocol,  // it answered something that makes no sense
    local,     // not the INS's fault: disk or database of this machine
    ended,     // what the port did in the INS's place is over before its time: asking again tells no more
  };
  Kind kind = Kind::link;
  std::uint8_t nrc = 0;
  std::string message;
};

template <typename T>
using Answer = tl::expected<T, PortError>;

using Bytes = std::vector<std::uint8_t>;

class InsPort {
 public:
  virtual ~InsPort() = default;

  // Sends a UDS request (service identifier first). The callback gets the positive response, or why there is none;
  // it comes later, from the loop, never from inside this call. One request at a time. A response that announces more
  // than `longest_answer` bytes is refused as a protocol error before any of it is received.
  virtual void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
                       std::function<void(Answer<Bytes>)> done) = 0;
  virtual void cancel() = 0;  // forget the request in progress
  virtual void reopen() = 0;  // after the link was lost: a fresh socket and transport, no session kept
  // TesterPresent every two seconds. Off at first: only a run that needs its session keeps one.
  virtual void keep_session(bool keep) = 0;
  // What the INS stated in its answer to DiagnosticSessionControl.
  virtual void take_timings(const uds::SessionTimings& stated) = 0;
  virtual std::uint64_t lost_frames() const = 0;
  virtual std::string_view interface() const = 0;  // begins every message about it

  // Each error frame of the CAN controller, as it comes.
  std::function<void(can::BusEvent)> on_bus_event;
  // The state by the last status frames, after each batch that held one.
  std::function<void(const ins::Status&)> on_status;
};

}  // namespace selfcal
