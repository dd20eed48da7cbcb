#include "daemon/host/bus_connection.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/epoll.h>
#include <unistd.h>

#include <cstdlib>

#include "protocol/operator_api/names.hpp"

namespace selfcal {

Expected<std::unique_ptr<sdbus::IConnection>> open_bus(const std::string& configured) {
  const char* chosen = std::getenv(operator_api::bus_variable);
  const std::string bus = chosen != nullptr && *chosen != '\0' ? chosen : configured;
  try {
    if (bus == "system") {
      return sdbus::createSystemBusConnection();
    }
    if (bus == "session") {
      return sdbus::createSessionBusConnection();
    }
    return sdbus::createSessionBusConnectionWithAddress(bus);
  } catch (const sdbus::Error& error) {
    return fail(ErrorKind::device, fmt::format("D-Bus ({}): {}", bus, error.getMessage()));
  }
}

BusPump::BusPump(EventLoop& loop, sdbus::IConnection& connection, std::function<void()> on_lost)
    : loop_(loop), connection_(connection), on_lost_(std::move(on_lost)) {
  // A duplicate: sd-bus closes its descriptor as soon as the bus is gone, while the loop still watches it.
  fd_ = ::fcntl(connection_.getEventLoopPollData().fd, F_DUPFD_CLOEXEC, 0);
  io_ = std::make_unique<EventLoop::Io>(loop_, fd_, EPOLLIN, [this](unsigned) { serve(); });
  serve();
}

BusPump::~BusPump() {
  loop_.cancel(timer_);
  io_.reset();
  ::close(fd_);
}

void BusPump::serve() {
  if (lost_) {
    return;
  }
  try {
    while (connection_.processPendingRequest()) {
    }
    const auto poll = connection_.getEventLoopPollData();
    unsigned events = 0;
    if ((poll.events & POLLIN) != 0) {
      events |= EPOLLIN;
    }
    if ((poll.events & POLLOUT) != 0) {
      events |= EPOLLOUT;
    }
    io_->want(events);
    loop_.cancel(timer_);
    timer_ = 0;
    if (const auto wait = poll.getRelativeTimeout()) {
      timer_ = loop_.after(*wait, [this] {
        timer_ = 0;
        serve();
      });
    }
  } catch (const sdbus::Error&) {
    lost_ = true;
    io_->want(0);
    on_lost_();
  }
}

}  // namespace selfcal
