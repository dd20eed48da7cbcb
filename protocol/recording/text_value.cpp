#include "protocol/recording/text_value.hpp"

#include <fmt/format.h>

#include "protocol/toml_file/utf8.hpp"

namespace selfcal {
namespace {

constexpr std::size_t longest = 256;

}  // namespace

std::optional<std::string> text_fault(std::string_view text) {
  if (text.size() > longest) {
    return fmt::format("{} bytes, at most {} allowed", text.size(), longest);
  }
  for (std::size_t k = 0; k < text.size(); ++k) {
    const auto byte = static_cast<unsigned char>(text[k]);
    if (byte < 0x20 || byte == 0x7F) {
      return fmt::format("control character 0x{:02X} at byte {}", byte, k);
    }
  }
  if (const auto place = first_malformed_utf8(text)) {
    return fmt::format("byte 0x{:02X} at {} is not UTF-8", static_cast<unsigned char>(text[*place]), *place);
  }
  return std::nullopt;
}

}  // namespace selfcal
