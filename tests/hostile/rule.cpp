#include "tests/hostile/rule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "protocol/byte_order.hpp"

namespace selfcal::hostile {
namespace {

constexpr std::array<std::string_view, 20> names = {
    "set",     "flip",      "truncate",   "append",     "replace",    "refuse",      "withhold",
    "swallow", "delay",     "repeat",     "previous",   "pending",    "stranger",    "frame",
    "trickle", "power_cut", "status_set", "status_raw", "status_off", "status_flood"};

// Offsets count from the service of the answer: three bytes of it before a record, four before a routine's status.
constexpr Field table[] = {
    {"session.p2", "1003", 2, '2', Seal::none},
    {"session.p2_star", "1003", 4, '2', Seal::none},
    {"session.echo", "1003", 1, '1', Seal::none},
    {"seed.level", "2701", 1, '1', Seal::none},
    {"seed.first", "2701", 2, '8', Seal::none},
    {"seed.last", "2701", 10, '8', Seal::none},
    {"key.level", "2702", 1, '1', Seal::none},
    {"serial.first", "22F18C", 3, '1', Seal::none},
    {"serial.last", "22F18C", 10, '1', Seal::none},
    {"software.first", "22F195", 3, '1', Seal::none},
    {"state.state", "220200", 3, '1', Seal::none},
    {"state.faults", "220200", 4, '1', Seal::none},
    {"state.slot", "220200", 5, '1', Seal::none},
    {"state.version", "220200", 6, '4', Seal::none},
    {"state.crc", "220200", 10, '4', Seal::none},
    {"state.run_id", "220200", 14, '4', Seal::none},
    {"state.power_cycles", "220200", 18, '4', Seal::none},
    {"site.latitude", "220202", 3, 'd', Seal::none},
    {"site.longitude", "220202", 11, 'd', Seal::none},
    {"site.height", "220202", 19, 'd', Seal::none},
    {"in_force.magic", "220210", 3, '4', Seal::coefficients},
    {"in_force.format", "220210", 7, '2', Seal::coefficients},
    {"in_force.version", "220210", 11, '4', Seal::coefficients},
    {"in_force.date", "220210", 15, '8', Seal::coefficients},
    {"in_force.author", "220210", 23, '8', Seal::coefficients},
    {"in_force.accel_bias_x", "220210", 55, 'd', Seal::coefficients},
    {"in_force.gyro_misalignment_zy", "220210", 239, 'd', Seal::coefficients},
    {"in_force.crc", "220210", 259, '4', Seal::none},
    {"inactive.magic", "220211", 3, '4', Seal::coefficients},
    {"inactive.version", "220211", 11, '4', Seal::coefficients},
    {"inactive.accel_bias_x", "220211", 55, 'd', Seal::coefficients},
    {"inactive.crc", "220211", 259, '4', Seal::none},
    {"directory.run_id", "220220", 3, '4', Seal::none},
    {"directory.first_page", "220220", 7, '4', Seal::none},
    {"directory.pages_written", "220220", 11, '4', Seal::none},
    {"directory.pages_expected", "220220", 15, '4', Seal::none},
    {"directory.samples", "220220", 19, '8', Seal::none},
    {"directory.complete", "220220", 27, '1', Seal::none},
    {"format.sample_rate", "220221", 3, 'd', Seal::none},
    {"format.delta_theta_lsb", "220221", 11, 'd', Seal::none},
    {"format.delta_v_lsb", "220221", 19, 'd', Seal::none},
    {"format.gimbal_lsb", "220221", 27, 'd', Seal::none},
    {"format.page_bytes", "220221", 35, '4', Seal::none},
    {"format.samples_per_page", "220221", 39, '2', Seal::none},
    {"check.done", "31030304", 4, '1', Seal::none},
    {"check.elapsed", "31030304", 5, 'd', Seal::none},
    {"check.north", "31030304", 13, 'd', Seal::none},
    {"check.east", "31030304", 21, 'd', Seal::none},
    {"check.max_horizontal", "31030304", 29, 'd', Seal::none},
    {"upload.format", "35", 1, '1', Seal::none},
    {"upload.longest", "35", 2, '4', Seal::none},
    {"block.counter", "36", 1, '1', Seal::none},
    {"page.magic", "36", 2, '4', Seal::page},
    {"page.format", "36", 6, '2', Seal::page},
    {"page.count", "36", 8, '2', Seal::page},
    {"page.run_id", "36", 10, '4', Seal::page},
    {"page.sequence", "36", 14, '4', Seal::page},
    {"page.first_sample", "36", 18, '8', Seal::page},
    {"page.temperature", "36", 26, '2', Seal::page},
    {"page.flags", "36", 28, '2', Seal::page},
    {"page.crc", "36", 34, '4', Seal::none},
    {"page.delta_theta_x", "36", 38, '4', Seal::page},
    {"exit.service", "37", 0, '1', Seal::none},
    {"schedule.echo", "2E0201", 1, '2', Seal::none},
    {"write.echo", "2E0211", 1, '2', Seal::none},
    {"start.echo", "31010301", 2, '2', Seal::none},
    {"erase.echo", "31010302", 2, '2', Seal::none},
    {"commit.echo", "31010303", 2, '2', Seal::none},
    {"check_start.echo", "31010304", 2, '2', Seal::none},
    {"reset.echo", "1101", 1, '1', Seal::none},
};

template <typename T>
uds::Bytes packed(T value) {
  uds::Bytes bytes(sizeof(T));
  ByteWriter(bytes).put(value);
  return bytes;
}

std::optional<double> double_of(std::string_view text) {
  if (text == "nan") {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (text == "inf" || text == "-inf") {
    return (text[0] == '-' ? -1.0 : 1.0) * std::numeric_limits<double>::infinity();
  }
  double value = 0.0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  return read.ec == std::errc{} && read.ptr == end ? std::optional(value) : std::nullopt;
}

std::optional<std::uint64_t> integer_of(std::string_view text, unsigned bits) {
  if (text == "max") {
    return bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
  }
  const bool hex = text.starts_with("0x");
  text.remove_prefix(hex ? 2 : 0);
  std::uint64_t value = 0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value, hex ? 16 : 10);
  const bool fits = bits == 64 || value >> bits == 0;
  return read.ec == std::errc{} && read.ptr == end && fits ? std::optional(value) : std::nullopt;
}

}  // namespace

std::optional<Kind> kind_called(std::string_view name) {
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? std::nullopt : std::optional(static_cast<Kind>(found - names.begin()));
}

std::string_view name(Kind kind) { return names[static_cast<std::size_t>(kind)]; }

bool of_status(Kind kind) { return kind >= Kind::status_set; }

bool Rule::matches(std::span<const std::uint8_t> message) const {
  return !of_status(kind) && message.size() >= request.size() &&
         std::equal(request.begin(), request.end(), message.begin());
}

std::string describe(const Rule& rule) {
  std::string text = fmt::format("{}", name(rule.kind));
  if (!rule.request.empty()) {
    text += fmt::format(" {:02X}", fmt::join(rule.request, ""));
  }
  text += fmt::format(" at {} times {}", rule.at, rule.times);
  if (!rule.bytes.empty()) {
    const std::size_t shown = std::min<std::size_t>(rule.bytes.size(), 24);
    text += fmt::format(" offset {} bytes {:02X}{}", rule.offset, fmt::join(std::span(rule.bytes).first(shown), ""),
                        shown < rule.bytes.size() ? "..." : "");
  }
  if (!rule.signal.empty()) {
    text += " " + rule.signal;
  }
  return text + fmt::format(" count {} seconds {}", rule.count, rule.seconds);
}

std::span<const Field> fields() { return table; }

std::optional<uds::Bytes> value_bytes(char type, std::string_view text) {
  if (type == 'd') {
    const auto value = double_of(text);
    if (!value) {
      return std::nullopt;
    }
    uds::Bytes bytes(8);
    ByteWriter(bytes).put(*value);
    return bytes;
  }
  const auto value = integer_of(text, 8U * static_cast<unsigned>(type - '0'));
  if (!value) {
    return std::nullopt;
  }
  switch (type) {
    case '1': return packed(static_cast<std::uint8_t>(*value));
    case '2': return packed(static_cast<std::uint16_t>(*value));
    case '4': return packed(static_cast<std::uint32_t>(*value));
    default: return packed(*value);
  }
}

std::optional<uds::Bytes> hex_bytes(std::string_view text) {
  uds::Bytes bytes(text.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char* at = text.data() + 2 * i;
    if (std::from_chars(at, at + 2, bytes[i], 16).ptr != at + 2) {
      return std::nullopt;
    }
  }
  return text.size() % 2 == 0 ? std::optional(bytes) : std::nullopt;
}

}  // namespace selfcal::hostile
