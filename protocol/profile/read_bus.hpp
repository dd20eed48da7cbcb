// The addressing of an INS, from its table of a profile.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {

inline constexpr std::string_view no_uds = "none";

// The word of its key `addressing`; empty where that is missing.
std::string read_bus(Section& section, Bus& bus);

}  // namespace selfcal::profile
