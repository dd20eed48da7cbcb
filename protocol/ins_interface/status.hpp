// The two periodic frames of the INS. 8 bytes each, little-endian signals as in the table (and so in the DBC).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/can/frame.hpp"

namespace selfcal::ins {

enum class State : std::uint8_t {
  starting = 0,  // after power-on, coefficients being read
  idle = 1,
  rotating = 2,  // self-calibration: gimbal moves or dwells, data go to FLASH
  complete = 3,  // schedule done, all pages written
  aborted = 4,   // stopped by request
  failed = 5,    // gimbal, sensor or FLASH failure
  checking = 6,  // free-inertial navigation check
};
std::string_view name(State state);

namespace fault {
inline constexpr std::uint8_t gimbal = 1;
inline constexpr std::uint8_t sensor = 2;
inline constexpr std::uint8_t flash = 4;
inline constexpr std::uint8_t coefficients = 8;  // no valid slot: the factory's are in force
}  // namespace fault

// What the frames told last. Angles as read out, 0 <= angle < 360.
struct Status {
  State state = State::starting;
  std::uint8_t faults = 0;    // of fault::
  std::uint8_t position = 0;  // 1 first; 0: not in a schedule
  bool moving = false;        // the gimbal turns
  bool unlocked = false;
  std::uint8_t session = 1;         // of ISO 14229-1: 1 default, 2 programming, 3 extended; 0: not told
  std::uint32_t pages_written = 0;  // of this run, 24 bits
  double outer_deg = 0.0;           // LSB 0.01
  double inner_deg = 0.0;
  double time_left_s = 0.0;  // of the rotation, on the INS's clock; LSB 0.1
};

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
