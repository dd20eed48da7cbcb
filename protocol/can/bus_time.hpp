// How long a frame holds the bus, to the bit: stuff bits are counted from the content (ISO 11898-1:2015).
//
// Classic: SOF to the end of the CRC is stuffed after five equal bits; delimiters, ACK, EOF and the 3 bits of
// intermission are not. FD: dynamic stuffing ends with the data; the stuff count and the CRC carry fixed stuff bits, one
// before each four bits, and the first of them stands in for a dynamic one. The rate changes at the sample point of BRS
// and back at that of the CRC delimiter: with equal sample points the two halves make one bit of each kind, so BRS counts
// as nominal and the CRC delimiter as data.
#pragma once

#include <cstdint>

#include "protocol/can/frame.hpp"
#include "protocol/time.hpp"

namespace selfcal::can {

struct BitRates {
  std::uint32_t nominal = 1'000'000;  // bit/s
  std::uint32_t data = 5'000'000;     // bit/s, FD frames with bit-rate switch
};

struct FrameBits {
  std::uint32_t nominal = 0;  // bits at the nominal rate, intermission included
  std::uint32_t data = 0;     // bits at the data rate
  std::uint32_t stuff = 0;    // how many of all these are stuff bits

  std::uint32_t total() const { return nominal + data; }
};

FrameBits frame_bits(const CanFrame& frame);

// Rounded up to a whole nanosecond.
Time frame_time(const CanFrame& frame, const BitRates& rates);

}  // namespace selfcal::can
