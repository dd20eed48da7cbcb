// The file of our own INS's profile, as compiled in: where a profile of somebody's own begins.
#pragma once

#include <string_view>

namespace selfcal::profile {

std::string_view built_in_text();

}  // namespace selfcal::profile
