// What a profile calls its identifiers, for messages: "coefficients.in_force".
#pragma once

#include <cstdint>
#include <string>

#include "protocol/profile/profile.hpp"
#include "protocol/uds/decode.hpp"

namespace selfcal::profile {

// As the profile's file has them; "0x1234" of one that is none of its.
std::string did_name(const Profile& profile, std::uint16_t did);
std::string routine_name(const Profile& profile, std::uint16_t routine);

// How a log of the bus is read: addresses, names, and the status frames, which keep a reference to the profile.
uds::DecoderOptions decoder_options(const ProfilePtr& profile);

}  // namespace selfcal::profile
