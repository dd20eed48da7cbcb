// A signal in the data of a CAN frame, as a DBC describes it: bits that are no whole bytes, in either order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/profile/layout.hpp"

namespace selfcal::profile {

struct Signal {
  std::string name;
  std::size_t line = 0;  // of the profile
  // Of the lowest bit in little-endian order (Intel), of the highest in big-endian order (Motorola); bit b of the frame is
  // bit b % 8 of byte b / 8, bit 0 the lowest, in both.
  std::size_t start = 0;
  std::size_t length = 1;
  ByteOrder order = ByteOrder::little;
  enum class Kind : std::uint8_t { whole, with_sign, floating } kind = Kind::whole;
  double scale = 1.0, offset = 0.0;              // value in the role's unit = number * scale + offset
  std::string unit;                              // as the profile writes it
  std::map<std::uint64_t, std::uint64_t> codes;  // the role's number to the frame's; empty: they are the same
  std::optional<std::uint64_t> constant;         // the bits are always these
};

// The positions of its bits in the frame, the lowest of the number first; fewer than `length` where it leaves the frame.
std::vector<std::size_t> bits_of(const Signal& signal, std::size_t frame_bytes);

// The bits as they stand. The signal lies in the frame.
std::uint64_t raw_of(const Signal& signal, std::span<const std::uint8_t> data);
void put_raw(const Signal& signal, std::uint64_t raw, std::span<std::uint8_t> data);

// A number, in the role's unit.
double value_of(const Signal& signal, std::uint64_t raw);
std::int64_t whole_of(const Signal& signal, std::uint64_t raw);  // of one without scale: its very number
// Rounded to the nearest; none where it does not fit.
std::optional<std::uint64_t> raw_for(const Signal& signal, double value);

}  // namespace selfcal::profile
