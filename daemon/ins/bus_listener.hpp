// The cause of missing answers: listens to all frames on the bus, without a filter, while requests go unanswered.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/host/config.hpp"
#include "protocol/can/socket.hpp"

namespace selfcal {

// Frames by kind, those that the daemon sends itself left out.
struct Heard {
  std::uint64_t others = 0;      // neither answers nor status frames of the INS
  std::uint64_t answers = 0;     // with its response_id, as configured: classic CAN or CAN FD
  std::uint64_t answers_fd = 0;  // as CAN FD, where classic CAN is configured
  std::uint64_t status = 0;      // its periodic frames, which an INS on CAN FD may send as classic CAN too
};

void count(const can::CanFrame& frame, const InsConfig& config, Heard& heard);
// One clause for the message that reports a missing answer.
std::string why_silent(const Heard& heard, const InsConfig& config);

class BusListener {
 public:
  explicit BusListener(const InsConfig& config);
  // All that came since it was made; empty where the interface cannot be listened to.
  std::string why_silent();

 private:
  InsConfig config_;
  std::optional<can::Socket> socket_;
  Heard heard_;
};

}  // namespace selfcal
