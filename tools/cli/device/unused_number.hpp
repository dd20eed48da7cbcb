// Identifiers that no INS has: ISO 14229-1, tables C.1 and F.1, reserve 0x0000 to 0x00FF.
#pragma once

#include <cstdint>

namespace selfcal::cli::device {

inline constexpr std::uint16_t unused_did = 0x00A5, unused_routine = 0x00A5;

}  // namespace selfcal::cli::device
