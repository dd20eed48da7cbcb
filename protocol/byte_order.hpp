// Big-endian numbers in byte buffers: everything in UDS records and FLASH pages is big-endian, as ISO 14229 has it.
#pragma once

#include <bit>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace selfcal {

// Writes one value after the other. The buffer must be long enough: its length is ours to choose, not a peer's.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> bytes) : bytes_(bytes) {}

  template <std::integral T>
  void put(T value) {
    assert(at_ + sizeof(T) <= bytes_.size());
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_[at_ + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * (sizeof(T) - 1 - i)));
    }
    at_ += sizeof(T);
  }
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }

  // Text in a field of fixed width, zero-padded; what is longer is cut.
  void put_text(std::string_view text, std::size_t width) {
    assert(at_ + width <= bytes_.size());
    for (std::size_t i = 0; i < width; ++i) {
      bytes_[at_ + i] = i < text.size() ? static_cast<std::uint8_t>(text[i]) : std::uint8_t{0};
    }
    at_ += width;
  }
  std::size_t written() const { return at_; }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// Reads one value after the other. A read beyond the end gives zeros and makes ok() false: check it once, at the end.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <std::integral T>
  T get() {
    const auto field = take(sizeof(T));
    std::uint64_t value = 0;
    for (const std::uint8_t byte : field) {
      value = value << 8 | byte;
    }
    return static_cast<T>(value);
  }
  double get_double() { return std::bit_cast<double>(get<std::uint64_t>()); }

  // Text of a field of fixed width, without the padding.
  std::string_view get_text(std::size_t width) {
    const auto field = take(width);
    std::size_t length = 0;
    while (length < field.size() && field[length] != 0) {
      ++length;
    }
    return {reinterpret_cast<const char*>(field.data()), length};
  }
  bool ok() const { return ok_; }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > left()) {
      ok_ = false;
      at_ = bytes_.size();
      return {};
    }
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace selfcal
