// The part of the interface document that says how records are read and written, and which there are: by identifiers, and by
// their place in the INS's memory.
#pragma once

#include <vector>

#include "protocol/profile/document_writer.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

// Of the table of services.
std::vector<Row> rows_of_reading(const Profile& profile);

void describe_identifiers(Writer& out, const Profile& profile);

// "identifier 0x0A05", "address 0x20001000".
std::string place_text(const Profile& profile, std::uint16_t did);

}  // namespace selfcal::profile
