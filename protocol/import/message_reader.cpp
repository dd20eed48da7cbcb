#include "protocol/import/message_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace selfcal::import {
namespace {

constexpr std::size_t encapsulation = 4;  // 0, endianness, two bytes of options
constexpr std::string_view zstd_magic = "\x28\xB5\x2F\xFD";

}  // namespace

MessageReader::MessageReader(std::string_view bytes, Encoding encoding)
    : bytes_(bytes), aligned_(encoding == Encoding::cdr) {
  const bool little = !aligned_ || begins_little();
  swap_ = little != (std::endian::native == std::endian::little);
}

bool MessageReader::begins_little() {
  if (bytes_.starts_with(zstd_magic)) {
    fail_with("compressed with zstd; `ros2 bag convert` writes it without compression");
    return true;
  }
  if (bytes_.size() < encapsulation) {
    fail_with(fmt::format("{} bytes; CDR begins with {}", bytes_.size(), encapsulation));
    return true;
  }
  const auto first = static_cast<unsigned char>(bytes_[0]);
  const auto second = static_cast<unsigned char>(bytes_[1]);
  if (first != 0 || second > 1) {
    fail_with(fmt::format("encoded as {:02X} {:02X}; plain CDR is 00 00 or 00 01", first, second));
  }
  at_ = begin_ = encapsulation;
  return second == 1;
}

void MessageReader::fail_with(std::string words) {
  if (fault_.empty()) {
    fault_ = std::move(words);
  }
}

const char* MessageReader::take(std::size_t size, std::size_t alignment) {
  if (!fault_.empty()) {
    return nullptr;
  }
  const std::size_t over = aligned_ ? (at_ - begin_) % alignment : 0;
  const std::size_t from = over == 0 ? at_ : at_ + alignment - over;
  if (from > bytes_.size() || size > bytes_.size() - from) {
    fail_with(fmt::format("{} bytes; byte {} and the {} behind it are wanted", bytes_.size(), from, size - 1));
    return nullptr;
  }
  at_ = from + size;
  return bytes_.data() + from;
}

template <typename Number>
Number MessageReader::number() {
  std::array<char, sizeof(Number)> raw{};
  if (const char* from = take(sizeof(Number), sizeof(Number))) {
    std::memcpy(raw.data(), from, sizeof(Number));
  }
  if (swap_) {
    std::reverse(raw.begin(), raw.end());
  }
  return std::bit_cast<Number>(raw);
}

std::uint32_t MessageReader::u32() { return number<std::uint32_t>(); }
double MessageReader::f64() { return number<double>(); }

std::string_view MessageReader::text() {
  const std::uint32_t length = count(1);
  const char* from = length == 0 ? nullptr : take(length, 1);
  if (from == nullptr) {
    return {};
  }
  // CDR counts the zero behind the text.
  const bool zero = aligned_ && from[length - 1] == '\0';
  return {from, length - (zero ? 1 : 0)};
}

std::uint32_t MessageReader::count(std::size_t element) {
  const std::uint32_t announced = u32();
  if (announced > (bytes_.size() - at_) / element) {
    fail_with(fmt::format("{} bytes; a length of {} stands before byte {}", bytes_.size(), announced, at_));
    return 0;
  }
  return announced;
}

void MessageReader::skip_f64(std::size_t numbers) {
  if (numbers > 0) {
    take(numbers * sizeof(double), sizeof(double));
  }
}

void MessageReader::end() {
  const std::size_t left = bytes_.size() - at_;
  const std::size_t padding = aligned_ ? 3 : 0;
  if (left > padding) {
    fail_with(fmt::format("{} bytes; the message ends behind {}", bytes_.size(), at_));
  }
}

}  // namespace selfcal::import
