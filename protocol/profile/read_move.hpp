// The table `move` of a profile.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {

// The state record of `profile` has been read: what tells that a move is over must stand in it. The key `did` or `memory` has been read
// too: `number`.
Move read_move(Section& section, Section& root, const Profile& profile, ByteOrder order,
               std::optional<std::uint16_t> number);

}  // namespace selfcal::profile
