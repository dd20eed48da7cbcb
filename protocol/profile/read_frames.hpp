// The part of a profile that describes plain frames: their identifiers and signals, and when a move is over.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {

// `profile` has bus and set already.
Frames read_frames(Section& root, const Profile& profile, ByteOrder order);

// The table `stream`: the frames of a sample beside UDS. `profile` has the bus.
std::vector<Frame> read_stream(Section& stream, const Profile& profile, ByteOrder order);

// The table `status`: what the state frame and the gimbal frame hold.
StatusFrames read_status_frames(Section& status, const Profile& profile, ByteOrder order);

}  // namespace selfcal::profile
