// What the INS keeps in FLASH: coefficient sets, security and power-cycle counters, raw data of the latest run.
//
// Blocks: 0 factory set | 1, 2 slots A and B | 3, 4 counters, written in turn | 5 header of the run | 16.. ring of pages.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/flash/page.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/records.hpp"
#include "sim_ins/device/flash_memory.hpp"

namespace selfcal::sim {

inline constexpr std::size_t raw_ring_first_block = 16;
inline constexpr std::size_t raw_ring_pages = 8192;  // 33.5 MB: 98 minutes at 200 Hz
inline constexpr std::size_t flash_bytes = (raw_ring_first_block + raw_ring_pages) * flash_block_bytes;
static_assert(flash::page_bytes == flash_block_bytes);

// Factory set and two slots. A slot counts once its record is whole and its commit mark, one word that names the
// record's CRC, is programmed: whatever byte a power cut hits, at least one complete set stays valid.
class CoefficientStore {
 public:
  explicit CoefficientStore(FlashMemory& flash) : flash_(flash) {}

  void write_factory_if_blank(const ins::Coefficients& set);
  // At power-on: the newest valid slot, or the factory's.
  void power_on();

  ins::Slot in_force_slot() const { return slot_; }
  const ins::Coefficients& in_force() const { return in_force_; }
  std::uint32_t in_force_crc() const;
  bool fell_back() const { return fell_back_; }  // a slot was written once, but none is valid
  ins::Slot inactive_slot() const { return slot_ == ins::Slot::a ? ins::Slot::b : ins::Slot::a; }

  std::optional<ins::Coefficients> factory() const { return read(ins::Slot::factory); }
  std::optional<ins::Coefficients> inactive() const { return read(inactive_slot()); }  // committed or not
  void erase_inactive();
  bool inactive_blank() const;
  bool write_inactive(const ins::Coefficients& set);  // false: not erased
  std::optional<std::uint32_t> inactive_crc() const;  // of the record there, if it is whole
  void commit_inactive();                             // which must be whole

  // Of an INS without slots, which has one place for its set (slot A) and its factory's: what is in force from the next
  // power-on on. A power cut while it is written over leaves the factory's.
  ins::Coefficients stored() const;
  void write_over(const ins::Coefficients& set);

 private:
  std::optional<ins::Coefficients> read(ins::Slot slot) const;
  bool committed(ins::Slot slot) const;

  FlashMemory& flash_;
  ins::Slot slot_ = ins::Slot::factory;
  ins::Coefficients in_force_;
  bool fell_back_ = false;
};

// Counters that survive a reset; two copies written in turn, the newer valid one counts.
struct Counters {
  std::uint32_t generation = 0;
  std::uint32_t power_cycles = 0;
  std::uint32_t key_attempts = 0;  // SecurityAccess: keys received since the last right one
};

class CounterStore {
 public:
  explicit CounterStore(FlashMemory& flash) : flash_(flash) {}
  void power_on();
  const Counters& get() const { return counters_; }
  void set(std::uint32_t power_cycles, std::uint32_t key_attempts);

 private:
  FlashMemory& flash_;
  Counters counters_;
};

// Raw data of the latest run. Pages go round a ring, page p in block p modulo its length: beyond that the oldest are
// lost, and directory() says which are held. The block after the newest page is blank, and a run begins by blanking the
// first block and the last two, so that pages of an earlier run, whatever its number was, are never taken for this one's.
class RawStore {
 public:
  explicit RawStore(FlashMemory& flash, std::size_t samples_per_page = flash::samples_per_page)
      : flash_(flash), samples_per_page_(samples_per_page) {}

  void power_on();  // finds the latest run and how far it got
  void begin(std::uint32_t run_id, std::uint32_t pages_expected);
  void append(const flash::Page& page);
  void end() { complete_ = true; }

  ins::DirectoryRecord directory() const;
  std::uint32_t pages_written() const { return written_; }
  std::uint32_t first_page() const { return first_; }  // the oldest that is held
  std::span<const std::uint8_t> page(std::uint32_t index) const;
  // Fault on demand: a bit of the page flips in the next `times` readings.
  void spoil(std::uint32_t index, int times);
  std::optional<std::uint32_t> spoilt() const { return spoilt_; }
  void mend();  // one reading done

 private:
  std::optional<flash::Page> page_of_run(std::size_t block) const;  // in a block of the ring, whole and of this run
  void find_pages();

  FlashMemory& flash_;
  std::size_t samples_per_page_;
  std::uint32_t run_id_ = 0, expected_ = 0, first_ = 0, written_ = 0;
  std::uint64_t samples_ = 0;
  bool complete_ = true;
  std::optional<std::uint32_t> spoilt_;
  int spoilt_times_ = 0;
};

}  // namespace selfcal::sim
