#include "protocol/ins_interface/dbc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "protocol/ins_interface/identifiers.hpp"
#include "protocol/ins_interface/status.hpp"

namespace selfcal::ins {
namespace {

constexpr std::uint32_t extended_bit = 0x80000000U;  // of an identifier of 29 bits, as a DBC writes it

struct Message {
  std::uint32_t id, signals_of;
  std::string_view name;
  std::string_view sender;
  std::string_view comment;
};

// `signals_of` is the table's identifier of the frame whose signals it has.
std::vector<Message> messages_of(const DbcIdentifiers& ids) {
  std::vector<Message> messages{{ids.request, 0, "UdsRequest", "Tester", "ISO 15765-2 and ISO 14229-1, tester to INS"},
                                {ids.response, 0, "UdsResponse", "INS", "ISO 15765-2 and ISO 14229-1, INS to tester"},
                                {ids.functional, 0, "UdsFunctionalRequest", "Tester", "single frames, tester to all"}};
  if (ids.status) {
    messages.push_back({*ids.status, can_id::status, "InsState", "INS", "periodic"});
    messages.push_back({*ids.status + 1, can_id::gimbal, "InsGimbal", "INS", "periodic"});
  }
  for (Message& message : messages) {
    message.id |= ids.extended ? extended_bit : 0U;
  }
  return messages;
}

// "0=idle 1=busy" to the DBC's `0 "idle" 1 "busy"`.
std::string value_descriptions(std::string_view values) {
  std::string result;
  while (!values.empty()) {
    const std::string_view item = values.substr(0, values.find(' '));
    const std::size_t equals = item.find('=');
    result += fmt::format(" {} \"{}\"", item.substr(0, equals), item.substr(equals + 1));
    values.remove_prefix(std::min(values.size(), item.size() + 1));
  }
  return result;
}

}  // namespace

std::string dbc_text(const DbcIdentifiers& identifiers) {
  const std::vector<Message> messages = messages_of(identifiers);
  std::string text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: INS Tester\n\n";
  auto out = std::back_inserter(text);
  for (const Message& message : messages) {
    fmt::format_to(out, "BO_ {} {}: 8 {}\n", message.id, message.name, message.sender);
    for (const Signal& s : status_signals) {
      if (s.frame_id == message.signals_of) {  // @1+: little-endian, unsigned
        fmt::format_to(out, " SG_ {} : {}|{}@1+ ({},0) [{}|{}] \"{}\" Tester\n", s.name, s.start_bit, s.bits, s.factor,
                       s.minimum, s.maximum, s.unit);
      }
    }
    text += '\n';
  }
  for (const Message& message : messages) {
    fmt::format_to(out, "CM_ BO_ {} \"{}\";\n", message.id, message.comment);
  }
  for (const Message& message : messages) {
    for (const Signal& s : status_signals) {
      if (s.frame_id == message.signals_of && !s.values.empty()) {
        fmt::format_to(out, "VAL_ {} {}{} ;\n", message.id, s.name, value_descriptions(s.values));
      }
    }
  }
  return text;
}

}  // namespace selfcal::ins
