// Whether text is UTF-8 (RFC 3629), and a form of it whose characters a parser with faulty tables cannot stumble over.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace selfcal {

// Place of the first byte that is not part of a well-formed sequence; nullopt: all is well.
std::optional<std::size_t> first_malformed_utf8(std::string_view text);

// Of well-formed text: each character from U+0080 to U+FFFF put by 0xF0000 higher, into the private plane 15; and back.
// Text that has characters of that plane itself (first_of_plane_15) does not come back as it was.
std::string lifted_to_plane_15(std::string_view text);
std::string back_from_plane_15(std::string_view text);
std::optional<std::size_t> first_of_plane_15(std::string_view text);

}  // namespace selfcal
