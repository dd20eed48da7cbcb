#include "sim_ins/device/flash_memory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <functional>
#include <utility>

namespace selfcal::sim {
namespace {

constexpr auto blank = [] {
  std::array<std::uint8_t, flash_block_bytes> block{};
  block.fill(0xFF);
  return block;
}();

}  // namespace

Expected<FlashMemory> FlashMemory::open(const std::string& path, std::size_t bytes) {
  assert(bytes % flash_block_bytes == 0);
  FlashMemory memory;
  memory.blocks_.resize(bytes / flash_block_bytes);
  if (path.empty()) {
    return memory;
  }
  const auto error = [&](const char* what) {
    return fail(ErrorKind::bad_input, fmt::format("FLASH file {}: {}: {}", path, what, std::strerror(errno)));
  };
  memory.fd_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (memory.fd_ < 0) {
    return error("cannot be opened");
  }
  std::size_t have = 0;
  while (have < bytes) {
    Block block;
    block.fill(0xFF);
    const ssize_t got = ::pread(memory.fd_, block.data(), block.size() - have % block.size(), static_cast<off_t>(have));
    if (got < 0) {
      return error("cannot be read");
    }
    if (got == 0) {
      break;
    }
    std::copy_n(block.begin(), got, memory.place(have));
    have += static_cast<std::size_t>(got);
  }
  memory.file_bytes_ = have;
  return memory;
}

FlashMemory::FlashMemory(FlashMemory&& other) noexcept
    : blocks_(std::move(other.blocks_)),
      fd_(std::exchange(other.fd_, -1)),
      file_bytes_(other.file_bytes_),
      budget_(other.budget_),
      timings_(other.timings_),
      now_s_(other.now_s_),
      pending_(std::move(other.pending_)) {}

FlashMemory& FlashMemory::operator=(FlashMemory&& other) noexcept {
  std::swap(blocks_, other.blocks_);
  std::swap(fd_, other.fd_);
  std::swap(file_bytes_, other.file_bytes_);
  std::swap(budget_, other.budget_);
  std::swap(timings_, other.timings_);
  std::swap(now_s_, other.now_s_);
  std::swap(pending_, other.pending_);
  return *this;
}

FlashMemory::~FlashMemory() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

std::span<const std::uint8_t> FlashMemory::read(std::size_t offset, std::size_t count) const {
  assert(offset + count <= size() && offset % flash_block_bytes + count <= flash_block_bytes);
  const auto& block = blocks_[offset / flash_block_bytes];
  return std::span(block ? *block : blank).subspan(offset % flash_block_bytes, count);
}

std::uint8_t* FlashMemory::place(std::size_t offset) {
  auto& block = blocks_[offset / flash_block_bytes];
  if (!block) {
    block = std::make_unique<Block>(blank);
  }
  return block->data() + offset % flash_block_bytes;
}

// One operation of the chip. Where the power goes in it, all before it is done, and of it what the power lasts for.
void FlashMemory::operate(std::size_t offset, std::span<const std::uint8_t> result, double duration_s) {
  const auto lasts =
      budget_ ? static_cast<std::size_t>(std::min<std::uint64_t>(*budget_, result.size())) : result.size();
  std::uint8_t* const here = place(offset);
  const double begin_s = ready_at_s();
  pending_.push_back({offset,
                      {here, here + lasts},
                      {result.begin(), result.begin() + static_cast<std::ptrdiff_t>(lasts)},
                      0,
                      begin_s,
                      begin_s + duration_s});
  std::copy_n(result.begin(), lasts, here);
  if (budget_) {
    *budget_ -= lasts;
  }
  if (lasts < result.size()) {
    advance(ready_at_s());
    throw PowerLost{};
  }
}

void FlashMemory::program(std::size_t offset, std::span<const std::uint8_t> bytes) {
  assert(offset + bytes.size() <= size());
  while (!bytes.empty()) {  // one page of the chip after another
    const std::size_t count = std::min(flash_program_bytes - offset % flash_program_bytes, bytes.size());
    std::array<std::uint8_t, flash_program_bytes> result{};
    std::transform(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count), place(offset), result.begin(),
                   std::bit_and<>());
    operate(offset, std::span(result).first(count), timings_.program_s);
    offset += count;
    bytes = bytes.subspan(count);
  }
}

void FlashMemory::erase(std::size_t block) { operate(block * flash_block_bytes, blank, timings_.erase_s); }

double FlashMemory::ready_at_s() const { return pending_.empty() ? now_s_ : pending_.back().end_s; }

void FlashMemory::settle(Operation& operation, std::size_t done) {
  store(operation.offset + operation.done, std::span(operation.after).first(done).subspan(operation.done));
  operation.done = done;
}

void FlashMemory::advance(double now_s) {
  now_s_ = std::max(now_s_, now_s);
  while (!pending_.empty() && pending_.front().end_s <= now_s_) {
    settle(pending_.front(), pending_.front().after.size());
    pending_.pop_front();
  }
  if (!pending_.empty() && pending_.front().begin_s < now_s_) {
    Operation& current = pending_.front();
    const double part = (now_s_ - current.begin_s) / (current.end_s - current.begin_s);
    const auto done = static_cast<std::size_t>(part * static_cast<double>(current.after.size()));
    settle(current, std::max(done, current.done));
  }
}

void FlashMemory::cut_power(double now_s) {
  advance(now_s);
  while (!pending_.empty()) {  // the latest first, should two have written to the same place
    const Operation& operation = pending_.back();
    std::copy(operation.before.begin() + static_cast<std::ptrdiff_t>(operation.done), operation.before.end(),
              place(operation.offset) + operation.done);
    pending_.pop_back();
  }
}

void FlashMemory::store(std::size_t offset, std::span<const std::uint8_t> bytes) {
  if (fd_ < 0) {
    return;
  }
  if (offset + bytes.size() > file_bytes_) {
    if (std::ranges::all_of(bytes, [](std::uint8_t b) { return b == 0xFF; })) {
      bytes = bytes.first(std::min(bytes.size(), file_bytes_ - std::min(file_bytes_, offset)));
    } else if (offset > file_bytes_) {
      const std::vector<std::uint8_t> gap(offset - std::exchange(file_bytes_, offset), 0xFF);
      write(offset - gap.size(), gap);
    }
  }
  if (!bytes.empty()) {
    file_bytes_ = std::max(file_bytes_, offset + bytes.size());
  }
  write(offset, bytes);
}

void FlashMemory::write(std::size_t offset, std::span<const std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (put <= 0) {  // a full disk under the simulator: the chip itself has no such failure
      fmt::print(stderr, "sim_ins: FLASH file: {}\n", std::strerror(errno));
      return;
    }
    offset += static_cast<std::size_t>(put);
    bytes = bytes.subspan(static_cast<std::size_t>(put));
  }
}

}  // namespace selfcal::sim
