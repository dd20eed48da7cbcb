// Helpers to write frames and messages in tests as a bus log would show them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/can/bus_log.hpp"
#include "protocol/isotp/transport.hpp"

namespace selfcal::test {

inline constexpr Time ms(std::int64_t n) { return std::chrono::milliseconds(n); }

// "648#3000000000000000", as candump writes it.
inline can::CanFrame frame(std::string_view text) {
  const auto entry = can::parse_log_line("(0.000000) t " + std::string(text));
  return entry ? entry->frame : can::CanFrame{};
}

inline std::string text(const can::CanFrame& f) {
  std::array<char, can::max_log_line> buffer{};
  return std::string(
      can::format_log_line(Time{0}, "t", f, false, buffer).substr(std::string_view("(0.000000) t ").size()));
}

inline std::vector<std::uint8_t> ramp(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) {
    bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
  }
  return bytes;
}

// Everything that may go out at `now`, reported as sent.
template <typename Node>
std::vector<std::string> take_all(Node& node, Time now) {
  std::vector<std::string> result;
  std::vector<can::CanFrame> out(4);
  while (const std::size_t count = node.pending(out, now)) {
    for (std::size_t i = 0; i < count; ++i) {
      result.push_back(text(out[i]));
    }
    node.sent(count, now);
  }
  return result;
}

inline isotp::Options tester_options() {
  isotp::Options options;
  options.address = {0x640, 0x648, 0x7DF, false};
  return options;
}

inline isotp::Options ins_options() {
  isotp::Options options;
  options.address = {0x648, 0x640, 0x7DF, false};
  return options;
}

}  // namespace selfcal::test
