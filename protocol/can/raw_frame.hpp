// Between our frame and the kernel's (linux/can.h).
#pragma once

#include <linux/can.h>

#include <cstddef>

#include "protocol/can/frame.hpp"

namespace selfcal::can {

// Fills a kernel frame; returns its length for the system call (CAN_MTU or CANFD_MTU).
std::size_t to_kernel(const CanFrame& frame, canfd_frame& raw);

// `length` is what the system call returned. An error frame keeps its flag bits out of the identifier.
CanFrame from_kernel(const canfd_frame& raw, std::size_t length);

}  // namespace selfcal::can
