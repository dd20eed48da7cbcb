// The FLASH chip: bytes that survive a power cut. Programming clears bits, only erasing a block sets them, and both take
// their time: what was asked for is done one after another, and where the power goes meanwhile it stays half done.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::sim {

inline constexpr std::size_t flash_block_bytes = 4096;   // smallest unit that is erased
inline constexpr std::size_t flash_program_bytes = 256;  // largest unit that is programmed at once

// Typical times of a serial NOR chip: Winbond W25Q64JV, AC characteristics, t_PP 0.8 ms (at most 3 ms) and t_SE 45 ms (at
// most 400 ms).
struct FlashTimings {
  double program_s = 0.8e-3;  // of up to 256 bytes that lie in one page of the chip
  double erase_s = 45e-3;     // of a block
};

// Thrown by a write during which the power went; nobody but the owner of the simulated power supply catches it.
struct PowerLost {};

class FlashMemory {
 public:
  // A memory of `bytes` (whole blocks), kept in the file, which ends with the last byte that was ever programmed: what is
  // beyond is erased. With an empty path it lives in this process only.
  [[nodiscard]] static Expected<FlashMemory> open(const std::string& path, std::size_t bytes);
  FlashMemory(FlashMemory&& other) noexcept;
  FlashMemory& operator=(FlashMemory&& other) noexcept;
  ~FlashMemory();

  // What the chip will hold when it has done all that was asked of it: the INS keeps in RAM what it is writing. Within
  // one block.
  std::span<const std::uint8_t> read(std::size_t offset, std::size_t count) const;
  void program(std::size_t offset, std::span<const std::uint8_t> bytes);  // new = old AND bytes, byte after byte
  void erase(std::size_t block);
  std::size_t size() const { return blocks_.size() * flash_block_bytes; }

  // The clock, seconds on any scale that does not go back: what is done by now is done for good.
  void advance(double now_s);
  double ready_at_s() const;  // when all that was asked for is done; in the past where nothing waits
  bool busy() const { return !pending_.empty(); }

  // The power goes, now: bytes that the chip had not come to are as they were before.
  void cut_power(double now_s);
  // The power goes after so many more bytes have been programmed or erased.
  void lose_power_after(std::optional<std::uint64_t> bytes) { budget_ = bytes; }
  void set_timings(const FlashTimings& timings) { timings_ = timings; }

 private:
  struct Operation {
    std::size_t offset = 0;
    std::vector<std::uint8_t> before;  // what a power cut leaves of the bytes not done
    std::vector<std::uint8_t> after;
    std::size_t done = 0;  // bytes
    double begin_s = 0.0, end_s = 0.0;
  };

  FlashMemory() = default;
  void operate(std::size_t offset, std::span<const std::uint8_t> result, double duration_s);
  void settle(Operation& operation, std::size_t done);
  void store(std::size_t offset, std::span<const std::uint8_t> bytes);
  void write(std::size_t offset, std::span<const std::uint8_t> bytes) const;  // to the file

  using Block = std::array<std::uint8_t, flash_block_bytes>;
  std::uint8_t* place(std::size_t offset);  // with a block of its own behind it

  std::vector<std::unique_ptr<Block>> blocks_;  // null: erased, and never written since this process began
  int fd_ = -1;
  std::size_t file_bytes_ = 0;
  std::optional<std::uint64_t> budget_;
  FlashTimings timings_;
  double now_s_ = 0.0;
  std::deque<Operation> pending_;  // in order of time, one ends where the next begins
};

}  // namespace selfcal::sim
