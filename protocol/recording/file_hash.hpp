// Which file an answer is about: its SHA-256 (FIPS 180-4), as `sha256sum` prints it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal {

// 64 lower-case hexadecimal digits of the whole file, read a piece at a time. bad_input where it cannot be read.
Expected<std::string> sha256_of_file(const std::filesystem::path& path);
// The same of a text.
std::string sha256_of_text(std::string_view text);

}  // namespace selfcal
