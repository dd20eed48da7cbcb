// The lock of an INS, from its table of a profile.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {

// A program is looked for where its path says, from the folder of the profile.
Security read_security(Section& section);

}  // namespace selfcal::profile
