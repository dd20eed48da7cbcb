#include "protocol/profile/signals.hpp"

#include <bit>
#include <cmath>

namespace selfcal::profile {
namespace {

constexpr std::size_t longest = 64;

std::int64_t extended(std::uint64_t raw, std::size_t length) {
  const std::size_t unused = longest - length;
  return static_cast<std::int64_t>(raw << unused) >> unused;
}

}  // namespace

std::vector<std::size_t> bits_of(const Signal& signal, std::size_t frame_bytes) {
  std::vector<std::size_t> bits;
  std::size_t at = signal.start;
  for (std::size_t k = 0; k < signal.length && at < 8 * frame_bytes; ++k) {
    bits.push_back(at);
    // Big-endian: downwards in a byte, then on at the highest bit of the next.
    at = signal.order == ByteOrder::little ? at + 1 : at % 8 == 0 ? at + 15 : at - 1;
  }
  if (signal.order == ByteOrder::big) {
    return {bits.rbegin(), bits.rend()};
  }
  return bits;
}

std::uint64_t raw_of(const Signal& signal, std::span<const std::uint8_t> data) {
  std::uint64_t raw = 0;
  std::size_t at = signal.start;
  for (std::size_t k = 0; k < signal.length; ++k) {
    const std::uint64_t bit = (data[at / 8] >> (at % 8)) & 1U;
    if (signal.order == ByteOrder::little) {
      raw |= bit << k;
      ++at;
    } else {
      raw = raw << 1U | bit;
      at = at % 8 == 0 ? at + 15 : at - 1;
    }
  }
  return raw;
}

void put_raw(const Signal& signal, std::uint64_t raw, std::span<std::uint8_t> data) {
  const auto bits = bits_of(signal, data.size());
  for (std::size_t k = 0; k < bits.size(); ++k) {
    const auto mask = static_cast<std::uint8_t>(1U << (bits[k] % 8));
    std::uint8_t& byte = data[bits[k] / 8];
    byte = static_cast<std::uint8_t>((raw >> k & 1U) != 0 ? byte | mask : byte & ~mask);
  }
}

std::int64_t whole_of(const Signal& signal, std::uint64_t raw) {
  return signal.kind == Signal::Kind::with_sign ? extended(raw, signal.length) : static_cast<std::int64_t>(raw);
}

double value_of(const Signal& signal, std::uint64_t raw) {
  double number = 0.0;
  if (signal.kind == Signal::Kind::floating) {
    number = signal.length == 32 ? std::bit_cast<float>(static_cast<std::uint32_t>(raw)) : std::bit_cast<double>(raw);
  } else if (signal.kind == Signal::Kind::with_sign) {
    number = static_cast<double>(extended(raw, signal.length));
  } else {
    number = static_cast<double>(raw);
  }
  return number * signal.scale + signal.offset;
}

std::optional<std::uint64_t> raw_for(const Signal& signal, double value) {
  const double number = (value - signal.offset) / signal.scale;
  if (signal.kind == Signal::Kind::floating) {
    return signal.length == 32 ? std::bit_cast<std::uint32_t>(static_cast<float>(number))
                               : std::bit_cast<std::uint64_t>(number);
  }
  const bool with_sign = signal.kind == Signal::Kind::with_sign;
  const double rounded = std::round(number);
  const double most = std::ldexp(1.0, static_cast<int>(signal.length) - (with_sign ? 1 : 0));
  if (!(rounded < most && rounded >= (with_sign ? -most : 0.0))) {
    return std::nullopt;
  }
  const std::uint64_t bits =
      with_sign ? static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded)) : static_cast<std::uint64_t>(rounded);
  return signal.length == longest ? bits : bits & ((std::uint64_t{1} << signal.length) - 1);
}

}  // namespace selfcal::profile
