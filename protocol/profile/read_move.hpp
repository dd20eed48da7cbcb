// The table `move` of a profile.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {

// The state record of `profile` has been read: what tells that a move is over must stand in it.
Move read_move(Section& section, Section& root, const Profile& profile, ByteOrder order);

}  // namespace selfcal::profile
