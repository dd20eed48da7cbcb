#include "protocol/can/bus_event.hpp"

#include <linux/can/error.h>

namespace selfcal::can {

std::string_view name(BusEvent event) {
  switch (event) {
    case BusEvent::bus_off: return "bus off";
    case BusEvent::restarted: return "controller restarted";
    case BusEvent::error_passive: return "error passive";
    case BusEvent::error_warning: return "error warning";
    case BusEvent::error_active: return "error active again";
    case BusEvent::controller_overrun: return "controller overrun";
    case BusEvent::transmit_timeout: return "transmit timeout";
    case BusEvent::not_acknowledged: return "frame not acknowledged";
    case BusEvent::arbitration_lost: return "arbitration lost";
    case BusEvent::protocol_error: return "protocol error on the bus";
    case BusEvent::transceiver: return "transceiver error";
    case BusEvent::other: return "unspecified bus error";
  }
  return "unspecified bus error";
}

BusEvent decode_error_frame(std::uint32_t id, std::span<const std::uint8_t> data) {
  const unsigned controller = (id & CAN_ERR_CRTL) != 0 && data.size() > 1 ? data[1] : 0U;
  if ((id & CAN_ERR_BUSOFF) != 0) {
    return BusEvent::bus_off;
  }
  if ((id & CAN_ERR_RESTARTED) != 0) {
    return BusEvent::restarted;
  }
  if ((controller & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) != 0) {
    return BusEvent::controller_overrun;
  }
  if ((controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) {
    return BusEvent::error_passive;
  }
  if ((controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0) {
    return BusEvent::error_warning;
  }
  if ((controller & CAN_ERR_CRTL_ACTIVE) != 0) {
    return BusEvent::error_active;
  }
  if ((id & CAN_ERR_TX_TIMEOUT) != 0) {
    return BusEvent::transmit_timeout;
  }
  if ((id & CAN_ERR_ACK) != 0) {
    return BusEvent::not_acknowledged;
  }
  if ((id & CAN_ERR_TRX) != 0) {
    return BusEvent::transceiver;
  }
  if ((id & (CAN_ERR_PROT | CAN_ERR_BUSERROR)) != 0) {
    return BusEvent::protocol_error;
  }
  return (id & CAN_ERR_LOSTARB) != 0 ? BusEvent::arbitration_lost : BusEvent::other;
}

}  // namespace selfcal::can
