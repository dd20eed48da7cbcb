#include "protocol/isotp/codec.hpp"

#include <algorithm>
#include <cassert>

namespace selfcal::isotp {
namespace {

constexpr std::uint32_t max_short_length = 4095;  // 12 bits
using Decoded = tl::expected<Pdu, CodecError>;

tl::unexpected<CodecError> no(CodecError error) { return tl::unexpected<CodecError>(error); }

// 9.6.2: up to 8 bytes the length stands in the low nibble; beyond that the nibble is 0 and a byte follows.
Decoded decode_single(std::span<const std::uint8_t> data) {
  std::size_t length = data[0] & 0x0FU;
  std::size_t header = 1;
  if (data.size() > 8) {
    if (length != 0) {
      return no(CodecError::bad_length);
    }
    length = data[1];
    header = 2;
  }
  if (length == 0) {
    return no(CodecError::bad_length);
  }
  if (header + length > data.size()) {
    return no(CodecError::truncated);
  }
  return SingleFrame{data.subspan(header, length)};
}

// 9.6.3: 12 bits of length, or zeros and then 32 bits of a length that 12 do not hold.
Decoded decode_first(std::span<const std::uint8_t> data, std::size_t address_bytes) {
  if (data.size() + address_bytes < 8) {
    return no(CodecError::truncated);
  }
  const std::uint32_t length = (data[0] & 0x0FU) << 8U | data[1];
  if (length != 0) {
    if (length <= max_single_payload(data.size())) {
      return no(CodecError::bad_length);
    }
    return FirstFrame{length, data.size(), data.subspan(2)};
  }
  std::uint32_t long_length = 0;
  for (std::size_t i = 2; i < 6; ++i) {
    long_length = long_length << 8U | data[i];
  }
  if (long_length <= max_short_length) {
    return no(CodecError::bad_length);
  }
  return FirstFrame{long_length, data.size(), data.subspan(6)};
}

Decoded decode_flow_control(std::span<const std::uint8_t> data) {
  if (data.size() < 3) {
    return no(CodecError::truncated);
  }
  const std::uint8_t status = data[0] & 0x0FU;
  if (status > 2) {
    return no(CodecError::bad_flow_status);
  }
  return FlowControl{static_cast<FlowStatus>(status), data[1], data[2]};
}

}  // namespace

tl::expected<Pdu, CodecError> decode(std::span<const std::uint8_t> data, std::size_t address_bytes) {
  if (data.empty()) {
    return no(CodecError::empty);
  }
  switch (data[0] >> 4U) {
    case 0: return decode_single(data);
    case 1: return decode_first(data, address_bytes);
    case 2:
      if (data.size() < 2) {
        return no(CodecError::truncated);
      }
      return ConsecutiveFrame{static_cast<std::uint8_t>(data[0] & 0x0FU), data.subspan(1)};
    case 3: return decode_flow_control(data);
    default: return no(CodecError::unknown_type);
  }
}

std::size_t max_single_payload(std::size_t frame_bytes) { return frame_bytes <= 8 ? frame_bytes - 1 : frame_bytes - 2; }

std::size_t first_frame_payload(std::uint32_t length, std::size_t frame_bytes) {
  return frame_bytes - (length <= max_short_length ? 2 : 6);
}

std::size_t encode_single(std::span<const std::uint8_t> payload, std::span<std::uint8_t> out,
                          std::size_t address_bytes) {
  if (payload.empty() || payload.size() > max_single_payload(out.size())) {
    return 0;
  }
  const bool fits_classic = payload.size() + address_bytes <= 7;
  const std::size_t header = fits_classic ? 1 : 2;
  out[0] = fits_classic ? static_cast<std::uint8_t>(payload.size()) : std::uint8_t{0};
  if (!fits_classic) {
    out[1] = static_cast<std::uint8_t>(payload.size());
  }
  std::ranges::copy(payload, out.begin() + static_cast<std::ptrdiff_t>(header));
  return header + payload.size();
}

std::size_t encode_first(std::uint32_t length, std::span<const std::uint8_t> payload, std::span<std::uint8_t> out) {
  const std::size_t taken = first_frame_payload(length, out.size());
  assert(payload.size() >= taken);
  if (length <= max_short_length) {
    out[0] = static_cast<std::uint8_t>(0x10U | length >> 8U);
    out[1] = static_cast<std::uint8_t>(length);
  } else {
    out[0] = 0x10;
    out[1] = 0;
    for (unsigned i = 0; i < 4; ++i) {
      out[2 + i] = static_cast<std::uint8_t>(length >> (24U - 8U * i));
    }
  }
  std::ranges::copy(payload.first(taken), out.end() - static_cast<std::ptrdiff_t>(taken));
  return taken;
}

std::size_t encode_consecutive(std::uint8_t sequence, std::span<const std::uint8_t> payload,
                               std::span<std::uint8_t> out) {
  assert(payload.size() < out.size());
  out[0] = static_cast<std::uint8_t>(0x20U | (sequence & 0x0FU));
  std::ranges::copy(payload, out.begin() + 1);
  return 1 + payload.size();
}

std::size_t encode_flow_control(const FlowControl& flow, std::span<std::uint8_t> out) {
  out[0] = static_cast<std::uint8_t>(0x30U | static_cast<unsigned>(flow.status));
  out[1] = flow.block_size;
  out[2] = flow.st_min;
  return 3;
}

Time separation_time(std::uint8_t st_min) {
  if (st_min <= 0x7F) {
    return std::chrono::milliseconds(st_min);
  }
  if (st_min >= 0xF1 && st_min <= 0xF9) {
    return std::chrono::microseconds(100 * (st_min - 0xF0));
  }
  return std::chrono::milliseconds(127);
}

std::uint8_t st_min_for(Time time) {
  using std::chrono::ceil;
  if (time <= Time{0}) {
    return 0;
  }
  const auto hundreds = (ceil<std::chrono::microseconds>(time).count() + 99) / 100;
  if (hundreds <= 9) {
    return static_cast<std::uint8_t>(0xF0 + hundreds);
  }
  return static_cast<std::uint8_t>(std::min<std::int64_t>(ceil<std::chrono::milliseconds>(time).count(), 127));
}

}  // namespace selfcal::isotp
