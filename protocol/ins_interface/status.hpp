// What an INS says again and again of itself. Where that stands in its frames is its profile's matter (profile/status_frames).
#pragma once

#include <cstdint>
#include <string_view>

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
  std::uint32_t pages_written = 0;  // of this run
  double outer_deg = 0.0;
  double inner_deg = 0.0;
  double time_left_s = 0.0;  // of the rotation, on the INS's clock
};

}  // namespace selfcal::ins
