// The part of a profile that says how the raw data come: upload, memory, file or stream, and the page that they hold.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {

// `profile` has bus and sample_format already.
void read_raw(Section& root, Profile& profile, ByteOrder order);

}  // namespace selfcal::profile
