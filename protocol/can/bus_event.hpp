// What SocketCAN error frames say (linux/can/error.h), as values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace selfcal::can {

enum class BusEvent : std::uint8_t {
  bus_off,
  restarted,
  error_passive,
  error_warning,
  error_active,        // recovered
  controller_overrun,  // the controller itself lost a frame
  transmit_timeout,
  not_acknowledged,  // nobody else on the bus
  arbitration_lost,
  protocol_error,  // form, stuff, CRC, bit error
  transceiver,
  other,
};

std::string_view name(BusEvent event);

// id: the identifier field of the error frame with its flag bits; data: its 8 bytes. The gravest one is reported.
BusEvent decode_error_frame(std::uint32_t id, std::span<const std::uint8_t> data);

}  // namespace selfcal::can
