#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "protocol/byte_order.hpp"
#include "protocol/uds/decode.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal::uds {
namespace {

using ByteView = std::span<const std::uint8_t>;
constexpr std::size_t shown_bytes = 16;
constexpr std::size_t shown_characters = 64;

std::string data_text(ByteView data) {
  if (data.empty()) {
    return "";
  }
  const ByteView head = data.first(std::min(data.size(), shown_bytes));
  const std::string more = data.size() > shown_bytes ? fmt::format(" … {} bytes", data.size()) : "";
  return fmt::format(": {:02X}{}", fmt::join(head, " "), more);
}

// Records that are text are shown as text; what a terminal would obey is escaped.
std::string record_text(std::uint16_t did, ByteView record, const Names& names) {
  if (record.empty() || !names.texts.contains(did)) {
    return data_text(record);
  }
  std::string text;
  for (const std::uint8_t c : record.first(std::min(record.size(), shown_characters))) {
    text += c >= 0x20 && c < 0x7F && c != '"' && c != '\\' ? std::string(1, static_cast<char>(c))
                                                           : fmt::format("\\x{:02X}", c);
  }
  return fmt::format(": \"{}\"{}", text,
                     record.size() > shown_characters ? fmt::format(" … {} bytes", record.size()) : "");
}

std::string_view name_of(const std::map<std::uint16_t, std::string>& names, std::uint16_t id) {
  const auto found = names.find(id);
  return found == names.end() ? std::string_view("unknown") : found->second;
}

// Address and size, behind their lengths: one hexadecimal digit each. None where the bytes are not enough.
struct Range {
  std::uint64_t from = 0, bytes = 0;
  std::size_t head = 0;  // bytes that say so
};
std::optional<Range> range_in(ByteView body) {
  const std::size_t address_bytes = body.empty() ? 0 : body[0] & 0x0FU, size_bytes = body.empty() ? 0 : body[0] >> 4U;
  if (address_bytes == 0 || size_bytes == 0 || address_bytes > 8 || size_bytes > 8 ||
      body.size() < 1 + address_bytes + size_bytes) {
    return std::nullopt;
  }
  const auto number = [](ByteView bytes) {
    std::uint64_t value = 0;
    for (const std::uint8_t byte : bytes) {
      value = value << 8U | byte;
    }
    return value;
  };
  return Range{number(body.subspan(1, address_bytes)), number(body.subspan(1 + address_bytes, size_bytes)),
               1 + address_bytes + size_bytes};
}

// Its data format stands before them.
std::string upload_text(ByteView body, const Names& names) {
  const auto range = body.empty() ? std::nullopt : range_in(body.subspan(1));
  if (!range || body.size() != 1 + range->head) {
    return data_text(body);
  }
  return fmt::format(" from {}, {} bytes",
                     names.upload_by_page ? fmt::format("page {}", range->from) : fmt::format("0x{:X}", range->from),
                     range->bytes);
}

// What is read; what is written, and the bytes that are.
std::string memory_text(ByteView body, const Names& names) {
  const auto range = range_in(body);
  if (!range) {
    return data_text(body);
  }
  const auto place = std::ranges::find_if(
      names.memory, [&](const Names::Place& p) { return range->from >= p.begin && range->from < p.end; });
  return fmt::format("{} from 0x{:X}, {} bytes", place == names.memory.end() ? "" : fmt::format(" {}", place->name),
                     range->from, range->bytes) +
         data_text(body.subspan(range->head));
}

std::string_view action_name(std::uint8_t action) {
  switch (static_cast<RoutineAction>(action)) {
    case RoutineAction::start: return "start";
    case RoutineAction::stop: return "stop";
    case RoutineAction::result: return "result";
  }
  return "unknown action";
}

std::string session_name(std::uint8_t session) {
  switch (static_cast<Session>(session)) {
    case Session::standard: return "default session";
    case Session::programming: return "programming session";
    case Session::extended: return "extended session";
  }
  return fmt::format("session 0x{:02X}", session);
}

std::string security_text(std::uint8_t level, ByteView rest) {
  // What unlocks the INS is told by its length alone.
  return fmt::format(" {} ({} bytes)", (level & 1U) != 0 ? "seed" : "key", rest.size());
}

// What follows the service, which is the same in requests and responses for most services.
std::string body_text(std::uint8_t service, ByteView body, bool response, const Names& names) {
  ByteReader in(body);
  switch (service) {
    case service::session_control:
      return body.empty() ? "" : fmt::format(" {}", session_name(body[0] & 0x7FU)) + data_text(body.subspan(1));
    case service::security_access: return body.empty() ? "" : security_text(body[0] & 0x7FU, body.subspan(1));
    case service::read_data:
    case service::write_data:
      if (const auto did = in.get<std::uint16_t>(); in.ok()) {
        return fmt::format(" {} (0x{:04X})", name_of(names.dids, did), did) + record_text(did, body.subspan(2), names);
      }
      break;
    case service::routine_control: {
      const auto action = in.get<std::uint8_t>();
      const auto routine = in.get<std::uint16_t>();
      if (in.ok()) {
        return fmt::format(" {} {} (0x{:04X})", action_name(action & 0x7FU), name_of(names.routines, routine),
                           routine) +
               data_text(body.subspan(3));
      }
      break;
    }
    case service::request_upload: return response ? data_text(body) : upload_text(body, names);
    case service::read_memory: return response ? data_text(body) : memory_text(body, names);
    case service::write_memory: return memory_text(body, names);
    case service::transfer_data:
      return body.empty() ? "" : fmt::format(" block {}, {} bytes", body[0], body.size() - 1);
    default: break;
  }
  return data_text(body);
}

}  // namespace

std::string describe_message(ByteView message, const Names& names) {
  if (message.empty()) {
    return "empty message";
  }
  if (message[0] == service::negative_response) {
    if (message.size() != 3) {
      return "malformed negative response" + data_text(message.subspan(1));
    }
    return fmt::format("negative {}: {}", service_name(message[1]), describe_nrc(message[2]));
  }
  const bool response = (message[0] & positive_offset) != 0;
  const auto service = static_cast<std::uint8_t>(message[0] & ~positive_offset);
  return fmt::format("{}{} (0x{:02X}){}", response ? "positive " : "", service_name(service), message[0],
                     body_text(service, message.subspan(1), response, names));
}

}  // namespace selfcal::uds
