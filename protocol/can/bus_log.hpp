// Bus logs as text, in the format of `candump -L`:
//   (1436509052.249713) can0 044#2A366C2BBA          classic, 11 bit     (8 digits of identifier: 29 bit)
//   (1436509052.249713) can0 7E8##1112233            FD, flags 1 = bit-rate switch, 2 = error state
//   (1436509052.249713) can0 123#R8                  remote
#pragma once

#include <cstddef>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/can/bus_time.hpp"
#include "protocol/can/frame.hpp"
#include "protocol/error.hpp"
#include "protocol/time.hpp"

namespace selfcal::can {

struct LogEntry {
  Time time{0};  // since 1970, written to the microsecond
  std::string interface;
  CanFrame frame;
  bool error_frame = false;  // frame.id then holds the error class bits
};

inline constexpr std::size_t max_log_line = 192;

// Writes the line without its end into the buffer (max_log_line is always enough) and returns it. No allocation.
std::string_view format_log_line(Time time, std::string_view interface, const CanFrame& frame, bool error_frame,
                                 std::span<char> buffer);

[[nodiscard]] Expected<LogEntry> parse_log_line(std::string_view line);

// Entry after entry of a log; blank lines are passed over. nullopt at the end; an error names the line number.
class LogReader {
 public:
  explicit LogReader(std::istream& in) : in_(in) {}
  [[nodiscard]] Expected<std::optional<LogEntry>> next();
  std::size_t line_number() const { return line_number_; }

 private:
  std::istream& in_;
  std::string line_;
  std::size_t line_number_ = 0;
};

}  // namespace selfcal::can
