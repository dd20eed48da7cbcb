// A profile from its file. What is wrong is told all at once, each fault a line "FILE:LINE: key: what".
#pragma once

#include <string>
#include <string_view>

#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

[[nodiscard]] Expected<ProfilePtr> parse_profile(std::string_view text, const std::string& file);
[[nodiscard]] Expected<ProfilePtr> load_profile(const std::string& file);

}  // namespace selfcal::profile
