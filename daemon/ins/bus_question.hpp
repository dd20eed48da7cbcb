// Asks an INS that no run needs whether it answers: one ReadDataByIdentifier of its serial number, in whatever session it is,
// while everything else on its bus is listened to.
#pragma once

#include <functional>
#include <string>

#include "daemon/host/config.hpp"
#include "daemon/host/event_loop.hpp"
#include "daemon/ins/bus_listener.hpp"
#include "daemon/ins/open_port.hpp"

namespace selfcal {

class BusQuestion {
 public:
  // `done` comes from the loop, after request_timeout_s at the latest, with one clause: "can0: up, the INS answers". It must
  // not destroy the question.
  BusQuestion(EventLoop& loop, const InsConfig& config, std::function<void(const std::string&)> done);

 private:
  std::string words_of(const Answer<Bytes>& answer);

  InsConfig config_;
  BusListener listener_;  // before the question, so that it hears all that follows
  std::unique_ptr<InsPort> port_;
};

}  // namespace selfcal
