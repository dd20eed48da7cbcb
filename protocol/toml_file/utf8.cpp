#include "protocol/toml_file/utf8.hpp"

namespace selfcal {
namespace {

// Length of the UTF-8 sequence at the front (RFC 3629), 0 where it is malformed.
std::size_t utf8_sequence(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char first = byte(0);
  if (first < 0x80) {
    return 1;
  }
  const std::size_t length = first >= 0xC2 && first <= 0xDF   ? 2
                             : first >= 0xE0 && first <= 0xEF ? 3
                             : first >= 0xF0 && first <= 0xF4 ? 4
                                                              : 0;
  if (length == 0 || length > text.size()) {
    return 0;
  }
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0) != 0x80) {
      return 0;
    }
  }
  const unsigned char second = byte(1);
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool surrogate = first == 0xED && second > 0x9F;
  const bool beyond = first == 0xF4 && second > 0x8F;
  return overlong || surrogate || beyond ? 0 : length;
}

bool of_plane_15(std::string_view sequence) {  // U+F0000 to U+FFFFF: F3 B0 80 80 to F3 BF BF BF
  return sequence.size() == 4 && sequence[0] == '\xF3' && static_cast<unsigned char>(sequence[1]) >= 0xB0;
}

char as_char(unsigned value) { return static_cast<char>(static_cast<unsigned char>(value)); }

}  // namespace

std::optional<std::size_t> first_malformed_utf8(std::string_view text) {
  for (std::size_t k = 0; k < text.size();) {
    const std::size_t length = utf8_sequence(text.substr(k));
    if (length == 0) {
      return k;
    }
    k += length;
  }
  return std::nullopt;
}

std::optional<std::size_t> first_of_plane_15(std::string_view text) {
  for (std::size_t k = 0; k < text.size(); k += utf8_sequence(text.substr(k))) {
    if (of_plane_15(text.substr(k, utf8_sequence(text.substr(k))))) {
      return k;
    }
  }
  return std::nullopt;
}

// In U+F0000 + c the upper four bits of c come into the second byte; the lower twelve keep their two.
std::string lifted_to_plane_15(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t k = 0, length = 0; k < text.size(); k += length) {
    length = utf8_sequence(text.substr(k));
    const std::string_view sequence = text.substr(k, length);
    if (length == 2) {  // 110aaaaa 10bbbbbb
      result += {'\xF3', '\xB0', as_char(0x80U | (static_cast<unsigned char>(sequence[0]) & 0x1FU)), sequence[1]};
    } else if (length == 3) {  // 1110aaaa 10bbbbbb 10cccccc
      result += {'\xF3', as_char(0xB0U | (static_cast<unsigned char>(sequence[0]) & 0x0FU)), sequence[1], sequence[2]};
    } else {
      result += sequence;
    }
  }
  return result;
}

std::string back_from_plane_15(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t k = 0; k < text.size();) {
    const std::size_t length = utf8_sequence(text.substr(k));
    const std::string_view sequence = text.substr(k, length == 0 ? 1 : length);  // a message may be cut in two
    k += sequence.size();
    if (!of_plane_15(sequence)) {
      result += sequence;
      continue;
    }
    const unsigned upper = static_cast<unsigned char>(sequence[1]) & 0x0FU;
    const unsigned middle = static_cast<unsigned char>(sequence[2]) & 0x3FU;
    if (upper == 0 && middle < 0x20) {
      result += {as_char(0xC0U | middle), sequence[3]};
    } else {
      result += {as_char(0xE0U | upper), sequence[2], sequence[3]};
    }
  }
  return result;
}

}  // namespace selfcal
