// The frames of ISO 15765-2:2016, bytes to values and back. No state, no allocation.
//
// Extended and mixed addressing have an address byte before them, which is not seen here: a frame then has one byte less, and
// `address_bytes` says so where that matters.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <tl/expected.hpp>
#include <variant>

#include "protocol/time.hpp"

namespace selfcal::isotp {

struct SingleFrame {
  std::span<const std::uint8_t> payload;
};
struct FirstFrame {
  std::uint32_t length = 0;               // of the whole message
  std::size_t frame_bytes = 0;            // length of this frame: that of all but the last consecutive frame
  std::span<const std::uint8_t> payload;  // its beginning
};
struct ConsecutiveFrame {
  std::uint8_t sequence = 0;              // 0..15
  std::span<const std::uint8_t> payload;  // with padding, if any
};
enum class FlowStatus : std::uint8_t { clear_to_send = 0, wait = 1, overflow = 2 };
struct FlowControl {
  FlowStatus status = FlowStatus::clear_to_send;
  std::uint8_t block_size = 0;  // consecutive frames until the next flow control; 0: all
  std::uint8_t st_min = 0;      // raw; see separation_time
};
using Pdu = std::variant<SingleFrame, FirstFrame, ConsecutiveFrame, FlowControl>;

enum class CodecError : std::uint8_t {
  empty,  // no byte at all
  unknown_type,
  bad_length,  // a length that this frame cannot have
  truncated,   // fewer bytes than the header or the length tells
  bad_flow_status,
};

// `data` is the payload of one CAN frame (up to 64 bytes). Spans point into it.
tl::expected<Pdu, CodecError> decode(std::span<const std::uint8_t> data, std::size_t address_bytes = 0);

// Encoders write into `out`, as long as the frame may become (8, or an FD length); padding is the transport's.
// Single, consecutive, flow control: return the bytes in use; single 0 if the payload does not fit. First: fills all of
// `out` from the beginning of the payload and returns how much of it went in.
std::size_t encode_single(std::span<const std::uint8_t> payload, std::span<std::uint8_t> out,
                          std::size_t address_bytes = 0);
std::size_t encode_first(std::uint32_t length, std::span<const std::uint8_t> payload, std::span<std::uint8_t> out);
std::size_t encode_consecutive(std::uint8_t sequence, std::span<const std::uint8_t> payload,
                               std::span<std::uint8_t> out);
std::size_t encode_flow_control(const FlowControl& flow, std::span<std::uint8_t> out);

std::size_t max_single_payload(std::size_t frame_bytes);                         // 7 for 8; n-2 for more
std::size_t first_frame_payload(std::uint32_t length, std::size_t frame_bytes);  // 12-bit or 32-bit length

// STmin byte to time: 0..0x7F ms; 0xF1..0xF9 100..900 us; reserved values mean 127 ms (9.6.5.5).
Time separation_time(std::uint8_t st_min);
std::uint8_t st_min_for(Time time);  // the smallest code that is not shorter; 127 ms at most

}  // namespace selfcal::isotp
