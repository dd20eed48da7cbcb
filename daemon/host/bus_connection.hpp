// The D-Bus connection on the daemon's own loop: no second thread.
#pragma once

#include <sdbus-c++/sdbus-c++.h>
#include <functional>
#include <memory>
#include <string>

#include "daemon/host/event_loop.hpp"
#include "protocol/error.hpp"

namespace selfcal {

// `bus`: system, session, or an address; SELFCAL_BUS outranks it.
Expected<std::unique_ptr<sdbus::IConnection>> open_bus(const std::string& bus);

// Lets `loop` serve the connection. When the bus goes away `on_lost` is called once.
class BusPump {
 public:
  BusPump(EventLoop& loop, sdbus::IConnection& connection, std::function<void()> on_lost);
  ~BusPump();
  void serve();  // after anything was sent or may have arrived

 private:
  EventLoop& loop_;
  sdbus::IConnection& connection_;
  std::function<void()> on_lost_;
  int fd_ = -1;
  std::unique_ptr<EventLoop::Io> io_;
  Timers::Id timer_ = 0;
  bool lost_ = false;
};

}  // namespace selfcal
