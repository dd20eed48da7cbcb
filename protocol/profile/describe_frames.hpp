// The document of an INS that speaks no UDS: its frames and their signals, and how it is turned and read.
#pragma once

#include "protocol/profile/document_writer.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

// The state frame and the gimbal frame of an INS that speaks UDS.
void describe_status(Writer& out, const Profile& profile);
// What an INS streams beside UDS.
void describe_stream(Writer& out, const Profile& profile);
void describe_frames(Writer& out, const Profile& profile);

}  // namespace selfcal::profile
