// Whether a CAN interface can carry a frame at all, as the kernel sees it.
#pragma once

#include <cstdint>
#include <string>

namespace selfcal::can {

enum class Link : std::uint8_t {
  absent,      // no interface of this name
  down,        // not set up
  no_carrier,  // set up, and its controller is off the bus (bus-off) or not connected
  up,
};

Link link_of(const std::string& interface);
// By the interface's flags (netdevice(7)).
Link link_by_flags(unsigned flags);
// "can0: up"; of the others what to do about it.
std::string link_text(const std::string& interface, Link link);

}  // namespace selfcal::can
