#include "protocol/can/link.hpp"

#include <fmt/format.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>

namespace selfcal::can {

Link link_by_flags(unsigned flags) {
  if ((flags & IFF_UP) == 0) {
    return Link::down;
  }
  return (flags & IFF_RUNNING) == 0 ? Link::no_carrier : Link::up;
}

Link link_of(const std::string& interface) {
  ifreq request{};
  if (interface.empty() || interface.size() >= IFNAMSIZ) {
    return Link::absent;
  }
  std::ranges::copy(interface, request.ifr_name);
  const int fd = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, 1);  // CAN_RAW
  if (fd < 0) {
    return Link::absent;
  }
  const bool known = ::ioctl(fd, SIOCGIFFLAGS, &request) == 0;
  ::close(fd);
  return known ? link_by_flags(static_cast<unsigned short>(request.ifr_flags)) : Link::absent;
}

std::string link_text(const std::string& interface, Link link) {
  switch (link) {
    case Link::absent: return fmt::format("{}: there is no CAN interface of this name", interface);
    case Link::down: return fmt::format("{0}: down (ip link set {0} up)", interface);
    case Link::no_carrier:
      return fmt::format(
          "{0}: the controller is off the bus (bus-off) or has no carrier (ip link set {0} type can restart)",
          interface);
    case Link::up: break;
  }
  return fmt::format("{}: up", interface);
}

}  // namespace selfcal::can
