// The part of a profile that describes one record: bytes, fields, each, checksum, given.
#pragma once

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"
#include "protocol/profile/roles.hpp"

namespace selfcal::profile {

// Asks `section` for the keys of a layout; faults go where the section's go. What the role needs and neither a field nor
// `given` has is a fault. Field by field: each field has an identifier, `did`, and no place; they stand one behind the other.
void read_layout(Section& section, const RecordRole& role, ByteOrder order, Record& record,
                 bool field_by_field = false);

}  // namespace selfcal::profile
