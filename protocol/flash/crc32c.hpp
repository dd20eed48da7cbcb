// CRC-32C (Castagnoli, polynomial 0x1EDC6F41 reflected, as in iSCSI, RFC 3720): of "123456789" it is 0xE3069283.
#pragma once

#include <cstdint>
#include <span>

namespace selfcal::flash {

// Of a and then b: crc32c(b, crc32c(a)).
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t before = 0);

}  // namespace selfcal::flash
