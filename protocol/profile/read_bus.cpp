#include "protocol/profile/read_bus.hpp"

#include <fmt/format.h>

#include <array>

namespace selfcal::profile {
namespace {

constexpr std::array<std::string_view, 8> addressings{"normal",      "normal-29", "normal-fixed", "extended",
                                                      "extended-29", "mixed",     "mixed-29",     no_uds};

// ISO 15765-2: the identifiers that normal fixed and mixed addressing of 29 bits make of two addresses, with priority 6.
struct FixedIds {
  std::uint32_t physical, functional;
};
constexpr FixedIds normal_fixed{0x18DA0000, 0x18DB0000}, mixed_29{0x18CE0000, 0x18CD0000};
constexpr std::uint32_t all_nodes = 0x33;

std::uint8_t address(Section& section, std::string_view key) {
  return static_cast<std::uint8_t>(section.whole(key, 0, 255, true).value_or(0));
}

void read_fixed(Section& section, const FixedIds& ids, Bus& bus) {
  const std::uint32_t ins = address(section, "ins_address");
  const std::uint32_t tester = address(section, "tester_address");
  if (section.has("ins_address") && section.has("tester_address") && ins == tester) {
    section.fault("tester_address", fmt::format("0x{:02X} is that of the INS already", tester));
  }
  bus.request = ids.physical | ins << 8U | tester;
  bus.response = ids.physical | tester << 8U | ins;
  bus.functional = ids.functional | all_nodes << 8U | tester;
}

std::uint32_t can_id(Section& section, std::string_view key, const Bus& bus) {
  return static_cast<std::uint32_t>(section.whole(key, 0, bus.extended_ids ? 0x1FFFFFFF : 0x7FF, true).value_or(0));
}

// One identifier must not mean two things; with extended addressing the address byte tells requests apart.
void read_ids(Section& section, bool by_address, Bus& bus) {
  bus.request = can_id(section, "request", bus);
  bus.response = can_id(section, "response", bus);
  bus.functional = can_id(section, "functional", bus);
  const auto same = [&](std::string_view key, std::uint32_t a, std::string_view other, std::uint32_t b) {
    if (section.has(key) && section.has(other) && a == b) {
      section.fault(key, fmt::format("identifier 0x{:04X} is that of {} already", a, section.path_of(other)));
    }
  };
  same("response", bus.response, "request", bus.request);
  same("functional", bus.functional, "response", bus.response);
  if (!by_address) {
    same("functional", bus.functional, "request", bus.request);
  }
}

void read_extended(Section& section, Bus& bus) {
  bus.request_byte = address(section, "ins_address");
  bus.response_byte = address(section, "tester_address");
  bus.functional_byte = address(section, "functional_address");
  const bool told = section.has("ins_address") && section.has("functional_address");
  if (told && bus.request == bus.functional && bus.request_byte == bus.functional_byte) {
    section.fault("functional_address",
                  fmt::format("0x{:02X} is that of the INS already, and both have one identifier", *bus.request_byte));
  }
}

void read_mixed(Section& section, Bus& bus) {
  bus.request_byte = bus.response_byte = bus.functional_byte = address(section, "address_extension");
}

void read_frames_of(Section& section, Bus& bus) {
  if (section.has("status")) {
    bus.status = can_id(section, "status", bus);
    for (const auto& [key, id] : {std::pair("request", bus.request), std::pair("response", bus.response),
                                  std::pair("functional", bus.functional)}) {
      if (id == *bus.status) {
        section.fault("status", fmt::format("identifier 0x{:04X} is that of {} already", id, section.path_of(key)));
      }
    }
  }
  bus.padding = static_cast<std::uint8_t>(section.whole("padding", 0, 255).value_or(0xCC));
  bus.block_size = static_cast<std::uint8_t>(section.whole("block_size", 0, 255).value_or(0));
  bus.st_min = static_cast<std::uint8_t>(section.whole("st_min", 0, 0xF9).value_or(0));
  if (bus.st_min > 0x7F && bus.st_min < 0xF1) {
    section.fault("st_min", fmt::format("0x{:02X} is reserved: 0 to 0x7F ms, 0xF1 to 0xF9 times 100 us", bus.st_min));
  }
}

}  // namespace

std::string read_bus(Section& section, Bus& bus) {
  if (!section.there()) {
    return {};
  }
  const std::string addressing = section.word("addressing", addressings, true).value_or("normal");
  bus.fd = section.flag("fd").value_or(false);
  if (addressing == no_uds) {
    bus.extended_ids = section.flag("extended_ids").value_or(false);
    section.only_these();
    return addressing;
  }
  bus.extended_ids = addressing.ends_with("-29") || addressing == "normal-fixed";
  if (addressing == "normal-fixed" || addressing == "mixed-29") {
    read_fixed(section, addressing == "mixed-29" ? mixed_29 : normal_fixed, bus);
  } else {
    read_ids(section, addressing.starts_with("extended"), bus);
  }
  if (addressing.starts_with("extended")) {
    read_extended(section, bus);
  } else if (addressing.starts_with("mixed")) {
    read_mixed(section, bus);
  }
  read_frames_of(section, bus);
  section.only_these();
  return addressing;
}

}  // namespace selfcal::profile
