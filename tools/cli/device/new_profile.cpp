#include "tools/cli/device/new_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>

#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/read_profile.hpp"

namespace selfcal::cli::device {
namespace {

constexpr std::string_view head =
    "# What an INS speaks. It begins as selfcal's own INS; change what yours has otherwise, and delete what it does "
    "not tell.\n"
    "#\n"
    "# A field: at (byte, from 0), type (u8 u16 u24 u32 u64 i8 i16 i24 i32 i64 f32 f64, ascii with length), count "
    "(elements),\n"
    "# byte_order, first_bit and bits (of an unsigned integer), scale, offset, unit, codes (words to numbers), "
    "constant.\n"
    "# A field that is no role's needs a constant: magic numbers, versions, reserved bytes.\n"
    "#\n"
    "#   selfcal device lint FILE        every fault, with its line\n"
    "#   selfcal device describe FILE    what it says, with pictures of the bytes\n"
    "#   sim_ins --profile FILE          a virtual INS that speaks so\n";

// The section without its header, and where it stands.
struct Part {
  std::size_t begin, end;
};
Part section(const std::string& text, std::string_view name) {
  const std::string header = fmt::format("\n[{}]\n", name);
  const std::size_t begin = text.find(header) + header.size();
  return {begin, std::min(text.find("\n[", begin), text.size())};
}

void replace_line(std::string& text, Part part, std::string_view key, std::string_view value) {
  const std::string begins = fmt::format("{} = ", key);
  std::size_t at = part.begin;
  while (at < part.end && text.compare(at, begins.size(), begins) != 0) {
    at = text.find('\n', at) + 1;
  }
  if (at < part.end) {
    text.replace(at, text.find('\n', at) - at, fmt::format("{}{}", begins, value));
  }
}

std::string bus_of(const NewProfile& a) {
  std::string text = fmt::format("addressing = \"{}\"\n", a.addressing);
  if (a.addressing == "normal-fixed") {
    text += fmt::format("ins_address = 0x{:02X}\ntester_address = 0x{:02X}\n", a.ins_address, a.tester_address);
  } else {
    text += fmt::format("request = 0x{:03X}\nresponse = 0x{:03X}\nfunctional = 0x{:03X}\n", a.request, a.response,
                        a.functional);
  }
  const profile::Bus& own = profile::built_in()->bus;
  return text + fmt::format("{}status = 0x{:03X}             # the gimbal frame has the next one\npadding = 0x{:02X}\n",
                            a.addressing == "normal" ? "" : "# ", own.status.value_or(0), own.padding);
}

// Nothing at the end of the input.
bool answer(std::string_view question, const std::string& kept, std::string& text) {
  std::fputs(fmt::format("{} [{}]: ", question, kept).c_str(), stderr);
  std::fflush(stderr);
  return static_cast<bool>(std::getline(std::cin, text));
}

bool ask_word(std::string_view question, std::initializer_list<std::string_view> known, std::string& value) {
  std::string text;
  while (answer(question, value, text)) {
    if (text.empty()) {
      return true;
    }
    if (known.size() == 0 || std::ranges::find(known, text) != known.end()) {
      value = text;
      return true;
    }
    std::fputs(fmt::format("{}: one of those words\n", text).c_str(), stderr);
  }
  return false;
}

bool ask_number(std::string_view question, std::uint32_t most, std::uint32_t& value) {
  std::string text;
  while (answer(question, fmt::format("0x{:X}", value), text)) {
    if (text.empty()) {
      return true;
    }
    char* end = nullptr;
    const unsigned long number = std::strtoul(text.c_str(), &end, 16);
    if (*end == '\0' && text[0] != '-' && number <= most) {
      value = static_cast<std::uint32_t>(number);
      return true;
    }
    std::fputs(fmt::format("{}: hexadecimal, 0 to {:X}\n", text, most).c_str(), stderr);
  }
  return false;
}

}  // namespace

void ask(NewProfile& a) {
  if (!ask_word("Name of the INS", {}, a.name) || !ask_word("Addressing: normal (11 bits), normal-29, normal-fixed",
                                                            {"normal", "normal-29", "normal-fixed"}, a.addressing)) {
    return;
  }
  const std::uint32_t most = a.addressing == "normal" ? 0x7FF : 0x1FFFFFFF;
  const bool fixed = a.addressing == "normal-fixed";
  const bool told = fixed ? ask_number("Address of the INS", 0xFF, a.ins_address) &&
                                ask_number("Address of the tester", 0xFF, a.tester_address)
                          : ask_number("Identifier of requests", most, a.request) &&
                                ask_number("Identifier of responses", most, a.response) &&
                                ask_number("Identifier of requests to all", most, a.functional);
  if (told && ask_word("Byte order of its numbers: big, little", {"big", "little"}, a.byte_order)) {
    ask_word("What opens its lock: aes-cmac, none", {"aes-cmac", "none"}, a.security);
  }
}

Expected<std::string> new_profile(const NewProfile& answers) {
  std::string text(profile::built_in_text());
  const Part bus = section(text, "bus");
  text.replace(bus.begin, bus.end - bus.begin, bus_of(answers));
  replace_line(text, section(text, "security"), "method", fmt::format("\"{}\"", answers.security));
  text.erase(0, text.find("name = "));
  const Part top{0, text.find("\n[")};
  replace_line(text, top, "byte_order", fmt::format("\"{}\"", answers.byte_order));
  replace_line(text, top, "name", fmt::format("\"{}\"", answers.name));
  text.insert(0, head);
  if (const auto read = profile::parse_profile(text, "new profile"); !read) {
    const std::string& faults = read.error().message;
    return fail(ErrorKind::usage, faults.substr(0, faults.find('\n')));
  }
  return text;
}

}  // namespace selfcal::cli::device
