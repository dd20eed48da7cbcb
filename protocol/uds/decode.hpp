// A log of CAN frames turned into UDS messages by name, and status frames into signals: `selfcal bus decode`.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/time.hpp"

namespace selfcal::uds {

// One line: service, DID or routine, NRC by name, the first bytes of data; of seeds and keys only their length.
std::string describe_message(std::span<const std::uint8_t> message);

struct DecoderOptions {
  std::uint32_t request_id = 0x640;
  std::uint32_t response_id = 0x648;
  std::uint32_t functional_id = 0x7DF;
  bool extended = false;
};

// Puts ISO-TP messages together by listening only (it sends no flow control).
class LogDecoder {
 public:
  explicit LogDecoder(const DecoderOptions& options);

  // A line when the frame completes a message, breaks one, or is a status frame; nullopt in the midst of a message and
  // for frames of others.
  std::optional<std::string> on_frame(const can::CanFrame& frame, Time time);

  std::uint64_t messages() const { return messages_; }
  std::uint64_t malformed() const { return malformed_; }

 private:
  struct Stream {
    std::uint32_t id = 0;
    std::string_view label;
    std::vector<std::uint8_t> bytes;
    std::size_t length = 0;  // 0: no message under way
    std::uint8_t sequence = 0;
  };
  std::optional<std::string> on_stream(Stream& stream, const can::CanFrame& frame, Time time);
  std::string message_line(const Stream& stream, std::span<const std::uint8_t> message, Time time);
  std::string broken_line(const Stream& stream, std::string_view why, Time time);

  DecoderOptions options_;
  std::array<Stream, 3> streams_;
  std::uint64_t messages_ = 0;
  std::uint64_t malformed_ = 0;
};

}  // namespace selfcal::uds
