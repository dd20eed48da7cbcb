// The only way to toml++ 3.3: text that would lead it into undefined behaviour or exhaust its stack is refused first.
#pragma once

#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal {

// `name` is what the message calls the text: "name:line: what", one line, bad_input. A byte order mark is passed over;
// characters of the private plane 15 are refused.
Expected<toml::table> parse_toml(std::string_view text, std::string_view name);

// For messages, which are one line: what a file holds may not be.
std::string one_line(std::string_view text);

}  // namespace selfcal
