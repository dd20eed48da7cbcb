// The 24 coefficients as an INS holds them: one record, the same in FLASH and on the bus, 260 bytes, big-endian.
//
//   0 u32 magic "SCCO"   4 u16 format, 1   6 u16 reserved   8 u32 version   12 i64 date, s since 1970 UTC
//   20 char[32] author   52 f64[24] SI, order of geometry's sensor_parameters   244 u8[12] reserved, 0   256 u32 CRC-32C
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal::ins {

inline constexpr std::size_t coefficient_count = 24;
inline constexpr std::size_t coefficients_bytes = 260;
inline constexpr std::size_t author_bytes = 32;

// Of each value, in the record's order; the same as geometry's sensor_parameters (a test compares).
extern const std::array<std::string_view, coefficient_count> coefficient_names;

struct Coefficients {
  std::uint32_t version = 0;                      // counts up with every calibration; 0: factory
  std::int64_t date_s = 0;                        // of the calibration, UTC, since 1970
  std::string author;                             // ASCII, 32 characters at most
  std::array<double, coefficient_count> value{};  // SI

  bool operator==(const Coefficients&) const = default;
};

using CoefficientsBytes = std::array<std::uint8_t, coefficients_bytes>;

CoefficientsBytes encode(const Coefficients& coefficients);
// Fails on length, magic, format, CRC, non-finite values.
[[nodiscard]] Expected<Coefficients> decode_coefficients(std::span<const std::uint8_t> bytes);
// The CRC in the record's last four bytes: its name when it is committed.
std::uint32_t stored_crc(std::span<const std::uint8_t, coefficients_bytes> bytes);

}  // namespace selfcal::ins
