// The port to an INS, as its profile says: frames alone; or UDS, and before it what stands in for what the INS does not have.
#pragma once

#include <memory>

#include "daemon/host/config.hpp"
#include "daemon/host/event_loop.hpp"
#include "daemon/ins/ins_port.hpp"

namespace selfcal {

std::unique_ptr<InsPort> open_port(EventLoop& loop, const InsConfig& config);

}  // namespace selfcal
