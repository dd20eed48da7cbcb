// The status frames of our own INS by a table of the tests' own: a second opinion of what protocol/profile makes of
// config/profiles/selfcal.toml. 8 bytes each, little-endian signals.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/can/frame.hpp"
#include "protocol/ins_interface/status.hpp"

namespace selfcal::ins {

// One signal of a status frame; little-endian, start bit as in a DBC.
struct Signal {
  std::uint32_t frame_id;
  std::string_view name;
  unsigned start_bit;
  unsigned bits;
  double factor;
  double minimum;
  double maximum;
  std::string_view unit;
  std::string_view values;  // "0=starting 1=idle ..." or empty
};
extern const std::array<Signal, 12> status_signals;

// `alive` counts the frames of each kind, modulo 256.
can::CanFrame encode_state_frame(const Status& status, std::uint8_t alive, std::uint32_t id);
can::CanFrame encode_gimbal_frame(const Status& status, std::uint8_t alive, std::uint32_t id);

// Raw value of a signal. The payload must be 8 bytes long.
std::uint32_t raw_signal(const Signal& signal, std::span<const std::uint8_t> payload);

// Takes a state or gimbal frame into `status`, and leaves alone what the frame does not tell. False: not such a
// frame, or one with an unknown state or of a wrong length; status is then unchanged.
bool apply_status_frame(const can::CanFrame& frame, Status& status);

}  // namespace selfcal::ins
