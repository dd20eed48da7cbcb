// A profile as an interface control document: what a firmware team would have to build so that this software can calibrate
// their INS. As Markdown, or as one HTML page that needs nothing beside it.
#pragma once

#include <string>

#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

enum class Markup : std::uint8_t { markdown, html };
std::string describe(const Profile& profile, Markup markup);

}  // namespace selfcal::profile
