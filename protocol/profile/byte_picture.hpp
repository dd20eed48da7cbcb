// A record drawn byte by byte, eight to a line, for people.
#pragma once

#include <string>

#include "protocol/profile/layout.hpp"

namespace selfcal::profile {

// Lines of text of one width; rows that say the same are told once. Of what is repeated one repetition is drawn.
std::string byte_picture(const Layout& layout);

}  // namespace selfcal::profile
