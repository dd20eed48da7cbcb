// The part of a profile that describes one record: bytes, fields, each, checksum, given.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"
#include "protocol/profile/roles.hpp"

namespace selfcal::profile {

// Asks `section` for the keys of a layout; faults go where the section's go. What the role needs and neither a field nor
// `given` has is a fault. Where the fields are numbered by a key, each has that and no place; they stand one behind the other.
inline constexpr std::string_view by_did = "did", by_index = "index";
void read_layout(Section& section, const RecordRole& role, ByteOrder order, Record& record,
                 std::string_view numbered_by = {});

}  // namespace selfcal::profile
