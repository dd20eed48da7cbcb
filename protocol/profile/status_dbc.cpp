#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/profile/dbc_file.hpp"
#include "protocol/profile/status_frames.hpp"

namespace selfcal::profile {
namespace {

constexpr std::uint32_t extended_bit = 0x80000000U;  // of an identifier of 29 bits, as a DBC writes it

struct Message {
  std::uint32_t id = 0;
  std::string name;
  std::string_view sender, comment;
  const Frame* frame = nullptr;  // whose signals it has
};

std::vector<Message> messages_of(const Profile& profile) {
  const Bus& bus = profile.bus;
  std::vector<Message> messages{{bus.request, "UdsRequest", "Tester", "ISO 15765-2 and ISO 14229-1, tester to INS"},
                                {bus.response, "UdsResponse", "INS", "ISO 15765-2 and ISO 14229-1, INS to tester"},
                                {bus.functional, "UdsFunctionalRequest", "Tester", "single frames, tester to all"}};
  if (bus.status) {
    messages.push_back({*bus.status, "InsState", "INS", "periodic", &profile.status.state});
    messages.push_back({*bus.status + 1, "InsGimbal", "INS", "periodic", &profile.status.gimbal});
  }
  for (const Frame& frame : profile.stream) {
    messages.push_back(
        {frame.id, fmt::format("Sample_{}", frame.name), "INS", "of each sample, while it rotates", &frame});
  }
  for (Message& message : messages) {
    message.id |= bus.extended_ids ? extended_bit : 0U;
  }
  return messages;
}

const RoleField* field_of(const Message& message, const Signal& signal) {
  const bool status = message.frame->name == "status.state" || message.frame->name == "status.gimbal";
  const auto& fields = frame_role(status ? std::string_view(message.frame->name) : "sample").signals;
  const auto field = std::ranges::find(fields, signal.name, &RoleField::name);
  return field == fields.end() ? nullptr : &*field;
}

// What the signal can be: its codes, an angle within a turn, or all that fits.
std::pair<double, double> range_of(const Signal& signal, const RoleField* field) {
  if (signal.constant) {
    return {static_cast<double>(*signal.constant), static_cast<double>(*signal.constant)};
  }
  if (!signal.codes.empty()) {
    const auto by_code = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto [least, most] = std::ranges::minmax_element(signal.codes, by_code);
    return {static_cast<double>(least->second), static_cast<double>(most->second)};
  }
  if (signal.kind == Signal::Kind::floating) {
    return {0.0, 0.0};  // as a DBC writes that it says nothing
  }
  const bool with_sign = signal.kind == Signal::Kind::with_sign;
  const double span = std::ldexp(1.0, static_cast<int>(signal.length) - (with_sign ? 1 : 0));
  double least = (with_sign ? -span : 0.0) * signal.scale + signal.offset;
  double most = (span - 1.0) * signal.scale + signal.offset;
  if (field != nullptr && field->unit == "deg") {
    least = std::max(least, -360.0 + signal.scale);
    most = std::min(most, 360.0 - signal.scale);
  }
  return {least, most};
}

std::string signal_line(const Message& message, const Signal& signal) {
  const RoleField* field = field_of(message, signal);
  const auto [least, most] = range_of(signal, field);
  return fmt::format(" SG_ {} : {}|{}@{}{} ({:.10g},{:.10g}) [{:.10g}|{:.10g}] \"{}\" Tester\n", dbc_name(signal.name),
                     signal.start, signal.length, signal.order == ByteOrder::little ? 1 : 0,
                     signal.kind == Signal::Kind::whole ? '+' : '-', signal.scale, signal.offset, least, most,
                     field == nullptr ? std::string_view() : field->unit);
}

std::string codes_line(const Message& message, const Signal& signal) {
  const RoleField* field = field_of(message, signal);
  std::vector<std::pair<std::uint64_t, std::string_view>> codes;
  for (const auto& [ours, theirs] : signal.codes) {
    codes.emplace_back(theirs, field->words[ours]);
  }
  std::ranges::sort(codes);
  std::string text = fmt::format("VAL_ {} {}", message.id, dbc_name(signal.name));
  for (const auto& [code, word] : codes) {
    text += fmt::format(" {} \"{}\"", code, word);
  }
  return text + " ;\n";
}

std::string interface_dbc(const Profile& profile) {
  const std::vector<Message> messages = messages_of(profile);
  std::string text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: INS Tester\n\n";
  for (const Message& message : messages) {
    text += fmt::format("BO_ {} {}: {} {}\n", message.id, message.name,
                        message.frame == nullptr ? 8 : message.frame->bytes, message.sender);
    if (message.frame != nullptr) {
      for (const Signal& signal : message.frame->signals) {
        text += signal_line(message, signal);
      }
    }
    text += '\n';
  }
  for (const Message& message : messages) {
    text += fmt::format("CM_ BO_ {} \"{}\";\n", message.id, message.comment);
  }
  for (const Message& message : messages) {
    if (message.frame != nullptr) {
      for (const Signal& signal : message.frame->signals) {
        text += signal.codes.empty() ? "" : codes_line(message, signal);
        text += signal.kind == Signal::Kind::floating ? fmt::format("SIG_VALTYPE_ {} {} : {};\n", message.id,
                                                                    dbc_name(signal.name), signal.length == 32 ? 1 : 2)
                                                      : "";
      }
    }
  }
  return text;
}

}  // namespace

std::string dbc_text(const Profile& profile) { return profile.frames ? frames_dbc(profile) : interface_dbc(profile); }

}  // namespace selfcal::profile
