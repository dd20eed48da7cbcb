// One CAN frame, classic or FD, as a value.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace selfcal::can {

inline constexpr std::size_t max_classic_bytes = 8;
inline constexpr std::size_t max_fd_bytes = 64;

struct CanFrame {
  std::uint32_t id = 0;  // 11 bits, or 29 if extended
  bool extended = false;
  bool remote = false;  // classic only; size is then the length asked for
  bool fd = false;
  bool bit_rate_switch = false;  // FD only
  bool error_state = false;      // FD only: the sender was error-passive (ESI)
  std::uint8_t size = 0;         // 0..8, or one of the FD lengths up to 64
  std::array<std::uint8_t, max_fd_bytes> data{};

  std::span<const std::uint8_t> payload() const { return {data.data(), size}; }
  bool operator==(const CanFrame& other) const;  // bytes beyond size do not count
};

// Length codes: 0..8 as they are, then 12 16 20 24 32 48 64 (ISO 11898-1, table of DLC).
std::uint8_t dlc_of_size(std::size_t size);     // of the shortest frame that holds size <= 64 bytes
std::size_t size_of_dlc(std::uint8_t dlc);      // dlc <= 15
std::size_t frame_size_for(std::size_t bytes);  // the shortest FD length that holds them

}  // namespace selfcal::can
