// The FLASH chip: bytes that survive a power cut. Programming clears bits, only erasing a block sets them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::sim {

inline constexpr std::size_t flash_block_bytes = 4096;   // smallest unit that is erased

// Thrown by a write during which the power went; nobody but the owner of the simulated power supply catches it.
struct PowerLost {};

class FlashMemory {
 public:
  // A memory of `bytes` (whole blocks), kept in the file; a new or shorter file is filled with erased bytes. With an
  // empty path it lives in this process only.
  [[nodiscard]] static Expected<FlashMemory> open(const std::string& path, std::size_t bytes);
  FlashMemory(FlashMemory&& other) noexcept;
  FlashMemory& operator=(FlashMemory&& other) noexcept;
  ~FlashMemory();

  std::span<const std::uint8_t> read(std::size_t offset, std::size_t count) const;
  void program(std::size_t offset, std::span<const std::uint8_t> bytes);   // new = old AND bytes, byte after byte
  void erase(std::size_t block);
  std::uint32_t erase_count(std::size_t block) const { return wear_[block]; }
  std::size_t size() const { return bytes_.size(); }

  // The power goes after so many more bytes have been programmed or erased.
  void lose_power_after(std::optional<std::uint64_t> bytes) { budget_ = bytes; }

 private:
  FlashMemory() = default;
  void store(std::size_t offset, std::size_t count);
  void spend();

  std::vector<std::uint8_t> bytes_;
  std::vector<std::uint32_t> wear_;          // since this process began
  int fd_ = -1;
  std::optional<std::uint64_t> budget_;
};

}  // namespace selfcal::sim
