#include "sim_ins/device/flash_memory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstring>
#include <utility>

namespace selfcal::sim {

Expected<FlashMemory> FlashMemory::open(const std::string& path, std::size_t bytes) {
  assert(bytes % flash_block_bytes == 0);
  FlashMemory memory;
  memory.bytes_.assign(bytes, 0xFF);
  memory.wear_.assign(bytes / flash_block_bytes, 0);
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
    const ssize_t got = ::pread(memory.fd_, memory.bytes_.data() + have, bytes - have, static_cast<off_t>(have));
    if (got < 0) {
      return error("cannot be read");
    }
    if (got == 0) {
      break;
    }
    have += static_cast<std::size_t>(got);
  }
  memory.store(have, bytes - have);
  return memory;
}

FlashMemory::FlashMemory(FlashMemory&& other) noexcept
    : bytes_(std::move(other.bytes_)),
      wear_(std::move(other.wear_)),
      fd_(std::exchange(other.fd_, -1)),
      budget_(other.budget_) {}

FlashMemory& FlashMemory::operator=(FlashMemory&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  std::swap(wear_, other.wear_);
  std::swap(fd_, other.fd_);
  std::swap(budget_, other.budget_);
  return *this;
}

FlashMemory::~FlashMemory() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

std::span<const std::uint8_t> FlashMemory::read(std::size_t offset, std::size_t count) const {
  assert(offset + count <= bytes_.size());
  return std::span(bytes_).subspan(offset, count);
}

void FlashMemory::spend() {
  if (budget_) {
    if (*budget_ == 0) {
      throw PowerLost{};
    }
    --*budget_;
  }
}

void FlashMemory::program(std::size_t offset, std::span<const std::uint8_t> bytes) {
  assert(offset + bytes.size() <= bytes_.size());
  std::size_t done = 0;
  try {
    for (; done < bytes.size(); ++done) {
      spend();
      bytes_[offset + done] &= bytes[done];
    }
  } catch (const PowerLost&) {
    store(offset, done);
    throw;
  }
  store(offset, done);
}

void FlashMemory::erase(std::size_t block) {
  const std::size_t offset = block * flash_block_bytes;
  ++wear_[block];
  std::size_t done = 0;
  try {
    for (; done < flash_block_bytes; ++done) {
      spend();
      bytes_[offset + done] = 0xFF;
    }
  } catch (const PowerLost&) {
    store(offset, done);
    throw;
  }
  store(offset, done);
}

void FlashMemory::store(std::size_t offset, std::size_t count) {
  while (fd_ >= 0 && count > 0) {
    const ssize_t put = ::pwrite(fd_, bytes_.data() + offset, count, static_cast<off_t>(offset));
    if (put <= 0) {   // a full disk under the simulator: the chip itself has no such failure
      fmt::print(stderr, "sim_ins: FLASH file: {}\n", std::strerror(errno));
      return;
    }
    offset += static_cast<std::size_t>(put);
    count -= static_cast<std::size_t>(put);
  }
}

}  // namespace selfcal::sim
