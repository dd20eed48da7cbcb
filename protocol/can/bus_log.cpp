#include "protocol/can/bus_log.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <net/if.h>

#include <algorithm>
#include <charconv>
#include <istream>

namespace selfcal::can {
namespace {

constexpr std::string_view hex_digits = "0123456789ABCDEF";

tl::unexpected<Error> bad_line(std::string_view why, std::string_view line) {
  return fail(ErrorKind::bad_input, fmt::format("candump log: {}: '{}'", why, line.substr(0, max_log_line)));
}

template <typename T>
bool parse_number(std::string_view text, int base, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return error == std::errc() && end == text.data() + text.size();
}

// "(seconds.microseconds)"
bool parse_time(std::string_view text, Time& time) {
  const std::size_t dot = text.find('.');
  if (text.size() < 4 || text.front() != '(' || text.back() != ')' || dot == std::string_view::npos) {
    return false;
  }
  std::uint32_t seconds = 0;
  std::uint32_t micros = 0;
  const std::string_view fraction = text.substr(dot + 1, text.size() - dot - 2);
  if (!parse_number(text.substr(1, dot - 1), 10, seconds) || fraction.size() != 6 ||
      !parse_number(fraction, 10, micros)) {
    return false;
  }
  time = std::chrono::seconds(seconds) + std::chrono::microseconds(micros);
  return true;
}

bool parse_identifier(std::string_view text, LogEntry& entry) {
  std::uint32_t raw = 0;
  if ((text.size() != 3 && text.size() != 8) || !parse_number(text, 16, raw)) {
    return false;
  }
  CanFrame& frame = entry.frame;
  if (text.size() == 3) {
    frame.id = raw;
    return raw <= CAN_SFF_MASK;
  }
  entry.error_frame = (raw & CAN_ERR_FLAG) != 0;
  frame.extended = !entry.error_frame;
  frame.id = raw & CAN_EFF_MASK;
  return (raw & ~(CAN_EFF_MASK | CAN_ERR_FLAG)) == 0;
}

bool parse_data(std::string_view text, CanFrame& frame) {
  if (text.size() % 2 != 0 || text.size() / 2 > (frame.fd ? max_fd_bytes : max_classic_bytes)) {
    return false;
  }
  frame.size = static_cast<std::uint8_t>(text.size() / 2);
  for (std::size_t i = 0; i < frame.size; ++i) {
    if (!parse_number(text.substr(2 * i, 2), 16, frame.data[i])) {
      return false;
    }
  }
  return frame_size_for(frame.size) == frame.size;
}

// What follows the identifier: "#DATA", "#R", "#Rn" or "##fDATA".
bool parse_content(std::string_view text, CanFrame& frame) {
  if (text.starts_with("##")) {
    std::uint8_t flags = 0;
    frame.fd = true;
    if (text.size() < 3 || !parse_number(text.substr(2, 1), 16, flags)) {
      return false;
    }
    frame.bit_rate_switch = (flags & CANFD_BRS) != 0;
    frame.error_state = (flags & CANFD_ESI) != 0;
    return parse_data(text.substr(3), frame);
  }
  if (text.starts_with("#R")) {
    frame.remote = true;
    return text.size() == 2 || (text.size() == 3 && parse_number(text.substr(2), 16, frame.size) && frame.size <= 8);
  }
  return text.starts_with("#") && parse_data(text.substr(1), frame);
}

}  // namespace

std::string_view format_log_line(Time time, std::string_view interface, const CanFrame& frame, bool error_frame,
                                 std::span<char> buffer) {
  const auto micros = std::chrono::duration_cast<std::chrono::microseconds>(time).count();
  const std::uint32_t raw_id = frame.id | (error_frame ? CAN_ERR_FLAG : 0U);
  const int width = frame.extended || error_frame ? 8 : 3;
  const auto head = fmt::format_to_n(buffer.data(), buffer.size(), "({}.{:06}) {} {:0{}X}{}", micros / 1'000'000,
                                     micros % 1'000'000, interface, raw_id, width, frame.fd ? "##" : "#");
  char* out = head.out;
  const char* const end = buffer.data() + buffer.size();
  const auto put = [&](char c) {
    if (out < end) {
      *out++ = c;
    }
  };
  if (frame.fd) {
    put(hex_digits[(frame.bit_rate_switch ? CANFD_BRS : 0U) | (frame.error_state ? CANFD_ESI : 0U)]);
  }
  if (frame.remote) {
    put('R');
    if (frame.size > 0) {
      put(hex_digits[frame.size & 0xFU]);
    }
  } else {
    for (const std::uint8_t byte : frame.payload()) {
      put(hex_digits[byte >> 4U]);
      put(hex_digits[byte & 0xFU]);
    }
  }
  return {buffer.data(), static_cast<std::size_t>(out - buffer.data())};
}

Expected<LogEntry> parse_log_line(std::string_view line) {
  auto next_word = [rest = line]() mutable {
    const std::size_t start = std::min(rest.find_first_not_of(" \t\r"), rest.size());
    const std::size_t end = std::min(rest.find_first_of(" \t\r", start), rest.size());
    const std::string_view word = rest.substr(start, end - start);
    rest.remove_prefix(end);
    return word;
  };
  const std::string_view time_text = next_word();
  const std::string_view interface = next_word();
  const std::string_view frame_text = next_word();
  const std::size_t hash = frame_text.find('#');
  LogEntry entry;
  if (!parse_time(time_text, entry.time)) {
    return bad_line("no time stamp (seconds.microseconds)", line);
  }
  if (interface.empty() || hash == std::string_view::npos) {
    return bad_line("not 'interface identifier#data'", line);
  }
  if (interface.size() >= IFNAMSIZ) {
    return bad_line(fmt::format("the name of an interface has at most {} characters", IFNAMSIZ - 1), line);
  }
  entry.interface = interface;
  if (!parse_identifier(frame_text.substr(0, hash), entry)) {
    return bad_line("identifier is neither 3 nor 8 hexadecimal digits in range", line);
  }
  if (!parse_content(frame_text.substr(hash), entry.frame)) {
    return bad_line("data are not those of a CAN frame", line);
  }
  return entry;
}

Expected<std::optional<LogEntry>> LogReader::next() {
  while (std::getline(in_, line_)) {
    ++line_number_;
    if (line_.find_first_not_of(" \t\r") == std::string::npos) {
      continue;
    }
    auto entry = parse_log_line(line_);
    if (!entry) {
      return fail(entry.error().kind, fmt::format("line {}: {}", line_number_, entry.error().message));
    }
    return std::optional<LogEntry>(std::move(*entry));
  }
  return std::optional<LogEntry>();
}

}  // namespace selfcal::can
