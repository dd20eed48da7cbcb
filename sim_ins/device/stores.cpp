#include "sim_ins/device/stores.hpp"

#include <algorithm>

#include "protocol/byte_order.hpp"
#include "protocol/flash/crc32c.hpp"

namespace selfcal::sim {
namespace {

constexpr std::size_t mark_offset = flash_block_bytes - 4;
constexpr std::uint32_t mark_key = 0x600DC0DE;  // mark = CRC of the record xor this
constexpr std::size_t counter_block = 3;
constexpr std::size_t counter_bytes = 16;
constexpr std::size_t run_block = 5;
constexpr std::size_t run_bytes = 12;

std::size_t block_of(ins::Slot slot) { return static_cast<std::size_t>(slot); }

std::uint32_t word_at(const FlashMemory& flash, std::size_t offset) {
  return ByteReader(flash.read(offset, 4)).get<std::uint32_t>();
}

std::span<const std::uint8_t, ins::coefficients_bytes> record_of(const FlashMemory& flash, ins::Slot slot) {
  return flash.read(block_of(slot) * flash_block_bytes, ins::coefficients_bytes).first<ins::coefficients_bytes>();
}

void program_word(FlashMemory& flash, std::size_t offset, std::uint32_t word) {
  std::array<std::uint8_t, 4> bytes{};
  ByteWriter(bytes).put(word);
  flash.program(offset, bytes);
}

}  // namespace

std::optional<ins::Coefficients> CoefficientStore::read(ins::Slot slot) const {
  auto set = ins::decode_coefficients(record_of(flash_, slot));
  return set ? std::optional(std::move(*set)) : std::nullopt;
}

bool CoefficientStore::committed(ins::Slot slot) const {
  return read(slot).has_value() && word_at(flash_, block_of(slot) * flash_block_bytes + mark_offset) ==
                                       (ins::stored_crc(record_of(flash_, slot)) ^ mark_key);
}

void CoefficientStore::write_factory_if_blank(const ins::Coefficients& set) {
  if (!read(ins::Slot::factory)) {
    flash_.erase(block_of(ins::Slot::factory));
    flash_.program(block_of(ins::Slot::factory) * flash_block_bytes, ins::encode(set));
  }
}

void CoefficientStore::power_on() {
  slot_ = ins::Slot::factory;
  in_force_ = factory().value_or(ins::Coefficients{});
  bool written = false;
  bool valid = false;
  for (const ins::Slot slot : {ins::Slot::a, ins::Slot::b}) {
    written = written || word_at(flash_, block_of(slot) * flash_block_bytes + mark_offset) != 0xFFFFFFFFU;
    if (!committed(slot)) {
      continue;
    }
    const ins::Coefficients set = *read(slot);
    if (!valid || set.version > in_force_.version) {
      slot_ = slot;
      in_force_ = set;
    }
    valid = true;
  }
  fell_back_ = written && !valid;
}

std::uint32_t CoefficientStore::in_force_crc() const { return ins::stored_crc(ins::encode(in_force_)); }

void CoefficientStore::erase_inactive() { flash_.erase(block_of(inactive_slot())); }

bool CoefficientStore::inactive_blank() const {
  const auto bytes = flash_.read(block_of(inactive_slot()) * flash_block_bytes, flash_block_bytes);
  return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t b) { return b == 0xFF; });
}

bool CoefficientStore::write_inactive(const ins::Coefficients& set) {
  if (!inactive_blank()) {
    return false;
  }
  flash_.program(block_of(inactive_slot()) * flash_block_bytes, ins::encode(set));
  return true;
}

std::optional<std::uint32_t> CoefficientStore::inactive_crc() const {
  return inactive() ? std::optional(ins::stored_crc(record_of(flash_, inactive_slot()))) : std::nullopt;
}

void CoefficientStore::commit_inactive() {
  const std::uint32_t mark = ins::stored_crc(record_of(flash_, inactive_slot())) ^ mark_key;
  program_word(flash_, block_of(inactive_slot()) * flash_block_bytes + mark_offset, mark);
}

ins::Coefficients CoefficientStore::stored() const {
  return (committed(ins::Slot::a) ? read(ins::Slot::a) : factory()).value_or(ins::Coefficients{});
}

void CoefficientStore::write_over(const ins::Coefficients& set) {
  const std::size_t at = block_of(ins::Slot::a) * flash_block_bytes;
  const auto record = ins::encode(set);
  flash_.erase(block_of(ins::Slot::a));
  flash_.program(at, record);
  program_word(flash_, at + mark_offset, ins::stored_crc(record) ^ mark_key);
}

void CounterStore::power_on() {
  counters_ = {};
  for (std::size_t copy = 0; copy < 2; ++copy) {
    const auto bytes = flash_.read((counter_block + copy) * flash_block_bytes, counter_bytes);
    ByteReader reader(bytes);
    Counters c;
    c.generation = reader.get<std::uint32_t>();
    c.power_cycles = reader.get<std::uint32_t>();
    c.key_attempts = reader.get<std::uint32_t>();
    if (reader.get<std::uint32_t>() == flash::crc32c(bytes.first(12)) && c.generation > counters_.generation) {
      counters_ = c;
    }
  }
}

void CounterStore::set(std::uint32_t power_cycles, std::uint32_t key_attempts) {
  counters_ = {counters_.generation + 1, power_cycles, key_attempts};
  std::array<std::uint8_t, counter_bytes> bytes{};
  ByteWriter writer(bytes);
  writer.put(counters_.generation);
  writer.put(counters_.power_cycles);
  writer.put(counters_.key_attempts);
  writer.put(flash::crc32c(std::span(bytes).first(12)));
  const std::size_t block = counter_block + counters_.generation % 2;
  flash_.erase(block);
  flash_.program(block * flash_block_bytes, bytes);
}

void RawStore::power_on() {
  run_id_ = expected_ = first_ = written_ = 0;
  samples_ = 0;
  complete_ = true;
  const auto bytes = flash_.read(run_block * flash_block_bytes, run_bytes);
  ByteReader reader(bytes);
  const auto run = reader.get<std::uint32_t>();
  const auto expected = reader.get<std::uint32_t>();
  if (reader.get<std::uint32_t>() != flash::crc32c(bytes.first(8))) {
    return;
  }
  run_id_ = run;
  expected_ = expected;
  find_pages();
}

std::optional<flash::Page> RawStore::page_of_run(std::size_t block) const {
  std::optional<flash::Page> page(std::in_place);
  if (!flash::decode_page(this->page(static_cast<std::uint32_t>(block)), *page) || page->run_id != run_id_ ||
      page->sequence % raw_ring_pages != block) {
    page.reset();
  }
  return page;
}

// What is of the run is one sequence without a gap, its newest page before a blank or torn block. It leads through the
// ring's first block, or that one is blank and the newest page is in one of the last two.
void RawStore::find_pages() {
  std::optional<flash::Page> newest;
  for (const std::size_t block : {std::size_t{0}, raw_ring_pages - 1, raw_ring_pages - 2}) {
    if (!newest) {
      newest = page_of_run(block);
    }
  }
  if (!newest) {
    return;
  }
  const std::uint32_t known = newest->sequence;
  const auto held = [&](std::uint32_t sequence) {
    auto page = page_of_run(sequence % raw_ring_pages);
    return page && page->sequence == sequence ? std::move(page) : std::nullopt;
  };
  while (auto next = held(newest->sequence + 1)) {
    newest = std::move(next);
  }
  written_ = newest->sequence + 1;
  first_ = known;
  while (first_ > 0 && held(first_ - 1)) {
    --first_;
  }
  samples_ = std::uint64_t{newest->sequence} * samples_per_page_ + newest->samples.size();  // all others are full
}

void RawStore::begin(std::uint32_t run_id, std::uint32_t pages_expected) {
  std::array<std::uint8_t, run_bytes> bytes{};
  ByteWriter writer(bytes);
  writer.put(run_id);
  writer.put(pages_expected);
  writer.put(flash::crc32c(std::span(bytes).first(8)));
  for (const std::size_t block : {std::size_t{0}, raw_ring_pages - 1, raw_ring_pages - 2}) {
    flash_.erase(raw_ring_first_block + block);  // before the header names the run
  }
  flash_.erase(run_block);
  flash_.program(run_block * flash_block_bytes, bytes);
  run_id_ = run_id;
  expected_ = pages_expected;
  first_ = written_ = 0;
  samples_ = 0;
  complete_ = false;
}

void RawStore::append(const flash::Page& page) {
  flash::PageBytes bytes;
  flash::encode_page(page, bytes);
  flash_.erase(raw_ring_first_block + (written_ + 1) % raw_ring_pages);  // what follows is blank at every moment
  flash_.program((raw_ring_first_block + written_ % raw_ring_pages) * flash_block_bytes, bytes);
  samples_ += page.samples.size();
  ++written_;
  constexpr auto most = static_cast<std::uint32_t>(raw_ring_pages - 1);  // one block is blank
  first_ = std::max(first_, written_ - std::min(written_, most));
}

ins::DirectoryRecord RawStore::directory() const {
  return {run_id_, first_page(), written_, expected_, samples_, complete_};
}

std::span<const std::uint8_t> RawStore::page(std::uint32_t index) const {
  return flash_.read((raw_ring_first_block + index % raw_ring_pages) * flash_block_bytes, flash_block_bytes);
}

void RawStore::spoil(std::uint32_t index, int times) {
  spoilt_ = index;
  spoilt_times_ = times;
}

void RawStore::mend() {
  if (--spoilt_times_ <= 0) {
    spoilt_.reset();
  }
}

}  // namespace selfcal::sim
