// The answer to a SecurityAccess seed: AES-CMAC-128 (NIST SP 800-38B, RFC 4493) of the 16 bytes of seed.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "protocol/error.hpp"

namespace selfcal::uds {

using SecurityKey = std::array<std::uint8_t, 16>;

// Fails (internal) only if OpenSSL cannot do AES-CMAC.
[[nodiscard]] Expected<std::array<std::uint8_t, 16>> answer_seed(const SecurityKey& key,
                                                                 std::span<const std::uint8_t> seed);

// Takes the same time wherever the difference is.
bool equal_in_constant_time(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b);

}  // namespace selfcal::uds
