// Whether text is UTF-8 (RFC 3629).
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace selfcal {

// Place of the first byte that is not part of a well-formed sequence; nullopt: all is well.
std::optional<std::size_t> first_malformed_utf8(std::string_view text);

}  // namespace selfcal
