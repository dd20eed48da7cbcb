#include "protocol/can/raw_frame.hpp"

#include <algorithm>

namespace selfcal::can {

std::size_t to_kernel(const CanFrame& frame, canfd_frame& raw) {
  raw = {};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
  raw.len = frame.size;
  std::ranges::copy(frame.payload(), raw.data);
  if (!frame.fd) {
    return CAN_MTU;
  }
  raw.flags = static_cast<__u8>((frame.bit_rate_switch ? CANFD_BRS : 0) | (frame.error_state ? CANFD_ESI : 0));
  return CANFD_MTU;
}

CanFrame from_kernel(const canfd_frame& raw, std::size_t length) {
  CanFrame frame;
  frame.fd = length == CANFD_MTU;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
  const bool whole = frame.extended || (raw.can_id & CAN_ERR_FLAG) != 0;
  frame.id = raw.can_id & (whole ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.size = std::min<std::uint8_t>(raw.len, frame.fd ? max_fd_bytes : max_classic_bytes);
  std::copy_n(raw.data, frame.size, frame.data.begin());
  if (frame.fd) {
    frame.bit_rate_switch = (raw.flags & CANFD_BRS) != 0;
    frame.error_state = (raw.flags & CANFD_ESI) != 0;
  }
  return frame;
}

}  // namespace selfcal::can
