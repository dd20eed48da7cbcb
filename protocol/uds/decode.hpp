// A log of CAN frames turned into UDS messages by name, and status frames into signals: `selfcal bus decode`.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/time.hpp"

namespace selfcal::uds {

// What an INS calls its numbers; one that is not among them is "unknown".
struct Names {
  std::map<std::uint16_t, std::string> dids, routines;
  std::set<std::uint16_t> texts;  // data identifiers whose record is text
  bool upload_by_page = false;    // RequestUpload counts pages
  struct Place {
    std::uint64_t begin = 0, end = 0;  // addresses; end is the first one behind it
    std::string name;
  };
  std::vector<Place> memory;  // what stands where
};

// One line: service, DID or routine, NRC by name, the first bytes of data; of seeds and keys only their length.
std::string describe_message(std::span<const std::uint8_t> message, const Names& names = {});

// What the frames of a log come to.
struct LogEntry {
  enum class Kind : std::uint8_t {
    message,  // a whole UDS message
    broken,   // one that came in parts which do not fit: words
    status,   // a status frame of the INS: signals
  };
  enum class Sender : std::uint8_t { tester, tester_to_all, ins };
  struct Signal {
    std::string name;
    double value = 0.0;
    std::string text;  // with its unit, or its word: "90 deg", "idle"
  };

  Time time{0};  // of the last frame
  Kind kind = Kind::message;
  Sender sender = Sender::tester;
  std::vector<std::uint8_t> message;
  std::vector<Signal> signals;
  std::string words;  // as describe_message; of a status frame each signal
};

struct DecoderOptions {
  std::uint32_t request_id = 0, response_id = 0, functional_id = 0;
  bool extended = false;
  // Extended and mixed addressing: the first byte of each frame.
  std::optional<std::uint8_t> request_byte, response_byte, functional_byte;
  Names names;
  // The signals of a status frame of the INS; none of any other frame.
  std::function<std::vector<LogEntry::Signal>(const can::CanFrame&)> status;
};

// "(1436509052.249713) tester  ReadDataByIdentifier (0x22) identity.serial (0x4001)"
std::string line(const LogEntry& entry);

// Puts ISO-TP messages together by listening only (it sends no flow control).
class LogDecoder {
 public:
  explicit LogDecoder(const DecoderOptions& options);

  // An entry when the frame completes a message, breaks one, or is a status frame; nullopt in the midst of a message and
  // for frames of others.
  std::optional<LogEntry> on_frame(const can::CanFrame& frame, Time time);

  std::uint64_t messages() const { return messages_; }
  std::uint64_t malformed() const { return malformed_; }

 private:
  struct Stream {
    std::uint32_t id = 0;
    std::optional<std::uint8_t> address;
    LogEntry::Sender sender = LogEntry::Sender::tester;
    std::vector<std::uint8_t> bytes;
    std::size_t length = 0;  // 0: no message under way
    std::uint8_t sequence = 0;
  };
  std::optional<LogEntry> on_stream(Stream& stream, std::span<const std::uint8_t> data, Time time);
  LogEntry whole(const Stream& stream, std::span<const std::uint8_t> message, Time time);
  LogEntry broken(const Stream& stream, std::string_view why, Time time);

  DecoderOptions options_;
  std::array<Stream, 3> streams_;
  std::uint64_t messages_ = 0;
  std::uint64_t malformed_ = 0;
};

}  // namespace selfcal::uds
