// The two frames in which an INS says what it is doing, again and again: state and gimbal. What stands where in them is the
// profile's matter; the identifiers are `bus.status` and the next one, where the configuration of the service says no others.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/ins_interface/status.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

// State and gimbal frame. A number that does not fit its signal is told as the nearest that does. `alive` counts the frames of
// each kind, modulo 256.
std::array<can::CanFrame, 2> encode_status(const Profile& profile, const ins::Status& status, std::uint8_t alive,
                                           std::uint32_t state_id, bool extended);

// Takes a state or gimbal frame into `status`, and leaves alone what the frame does not tell. False: not such a frame, or one with
// a state that the profile does not name, or of a wrong length; status is then unchanged.
bool apply_status(const Profile& profile, const can::CanFrame& frame, std::uint32_t state_id, bool extended,
                  ins::Status& status);

// What a state or gimbal frame says, signal by signal; nothing of any other.
struct NamedValue {
  std::string name;  // as the DBC has it: "OuterAngle"
  double value = 0.0;
  std::string text;  // with its unit, or its word: "90 deg", "idle"
};
std::vector<NamedValue> status_values(const Profile& profile, const can::CanFrame& frame);

// "outer_angle" as the DBC has it: "OuterAngle".
std::string dbc_name(std::string_view signal);

}  // namespace selfcal::profile
