// What is common to the attributes of both file forms.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace selfcal {

inline constexpr std::string_view recording_format = "ins-selfcal-recording";
inline constexpr int recording_version = 1;
inline constexpr std::string_view gimbal_absent_word = "absent";

// What is wrong with a text that is to be shown and stored: not UTF-8, a control character, or longer than 256
// bytes. nullopt: nothing.
std::optional<std::string> text_fault(std::string_view text);

}  // namespace selfcal
