#include "protocol/odx/communication.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "protocol/odx/dictionary.hpp"

namespace selfcal::odx {
namespace {

constexpr std::string_view transport = "ISO_15765_2", timing = "ISO_15765_3";

struct Parameter {
  std::string_view name;
  const char* kind;  // PARAM-CLASS
  bool text = false;
};
// Of CP_UniqueRespIdTable, in the order of the standard.
constexpr std::array table_parts{
    Parameter{"CP_CanPhysReqFormat", "UNIQUE_ID", true},  Parameter{"CP_CanPhysReqId", "UNIQUE_ID"},
    Parameter{"CP_CanPhysReqExtAddr", "UNIQUE_ID"},       Parameter{"CP_CanRespUSDTFormat", "UNIQUE_ID", true},
    Parameter{"CP_CanRespUSDTId", "UNIQUE_ID"},           Parameter{"CP_CanRespUSDTExtAddr", "UNIQUE_ID"},
    Parameter{"CP_CanRespUUDTFormat", "UNIQUE_ID", true}, Parameter{"CP_CanRespUUDTId", "UNIQUE_ID"},
    Parameter{"CP_CanRespUUDTExtAddr", "UNIQUE_ID"},      Parameter{"CP_ECULayerShortName", "UNIQUE_ID", true}};
constexpr std::array transport_parameters{Parameter{"CP_CanFuncReqFormat", "COM", true},
                                          Parameter{"CP_CanFuncReqId", "COM"},
                                          Parameter{"CP_CanFuncReqExtAddr", "COM"},
                                          Parameter{"CP_BlockSize", "COM"},
                                          Parameter{"CP_StMin", "TIMING"},
                                          Parameter{"CP_CanFillerByte", "COM"},
                                          Parameter{"CP_CanFillerByteHandling", "COM"}};
constexpr std::array timing_parameters{Parameter{"CP_P2Max", "TIMING"}, Parameter{"CP_P2Star", "TIMING"},
                                       Parameter{"CP_TesterPresentTime", "TIMING"}};

std::string id_of(std::string_view subset, std::string_view name) { return fmt::format("{}.{}", subset, name); }

void write_reference(Node refs, std::string_view subset, std::string_view name, std::span<const std::string> values) {
  Node node = add(refs, "COMPARAM-REF");
  attribute(node, "ID-REF", id_of(subset, name));
  attribute(node, "DOCREF", subset);
  attribute(node, "DOCTYPE", "COMPARAM-SUBSET");
  Node parent = values.size() > 1 ? add(node, "COMPLEX-VALUE") : node;
  for (const std::string& value : values) {
    add(parent, "SIMPLE-VALUE", value);
  }
  attribute(add(node, "PROTOCOL-SNREF"), "SHORT-NAME", protocol_name);
}

void write_parameter(Node parent, std::string_view subset, const Parameter& parameter) {
  Node node = add_named(parent, "COMPARAM", id_of(subset, parameter.name), parameter.name);
  attribute(node, "PARAM-CLASS", parameter.kind);
  attribute(node, "CPTYPE", "STANDARD");
  attribute(node, "CPUSAGE", "ECU-COMM");
  add(node, "PHYSICAL-DEFAULT-VALUE", parameter.text ? "" : "0");
  refer(node, "DATA-OBJECT-PROP-REF", id_of(subset, parameter.text ? "DOP.text" : "DOP.number"));
}

void write_properties(Node parent, std::string_view subset) {
  for (const bool text : {false, true}) {
    const std::string_view name = text ? "text" : "number";
    Node node = add_named(parent, "DATA-OBJECT-PROP", id_of(subset, fmt::format("DOP.{}", name)), name);
    add(add(node, "COMPU-METHOD"), "CATEGORY", "IDENTICAL");
    Node type = add(node, "DIAG-CODED-TYPE");
    attribute(type, "BASE-DATA-TYPE", text ? "A_ASCIISTRING" : "A_UINT32");
    attribute(type, "xsi:type", text ? "LEADING-LENGTH-INFO-TYPE" : "STANDARD-LENGTH-TYPE");
    add(type, "BIT-LENGTH", text ? "8" : "32");
    attribute(add(node, "PHYSICAL-TYPE"), "BASE-DATA-TYPE", text ? "A_UNICODE2STRING" : "A_UINT32");
  }
}

std::string subset_text(std::string_view name, const char* category, std::span<const Parameter> parameters,
                        bool with_table) {
  pugi::xml_document document;
  Node subset = add_named(begin_odx(document), "COMPARAM-SUBSET", name, name,
                          "Of the standard's parameters those that are used here.");
  attribute(subset, "CATEGORY", category);
  Node list = add(subset, "COMPARAMS");
  for (const Parameter& parameter : parameters) {
    write_parameter(list, name, parameter);
  }
  if (with_table) {
    constexpr std::string_view table = "CP_UniqueRespIdTable";
    Node node = add_named(add(subset, "COMPLEX-COMPARAMS"), "COMPLEX-COMPARAM", id_of(name, table), table);
    attribute(node, "PARAM-CLASS", "UNIQUE_ID");
    attribute(node, "CPTYPE", "STANDARD");
    attribute(node, "CPUSAGE", "ECU-COMM");
    attribute(node, "ALLOW-MULTIPLE-VALUES", "true");
    for (const Parameter& part : table_parts) {
      write_parameter(node, name, part);
    }
  }
  write_properties(add(subset, "DATA-OBJECT-PROPS"), name);
  return text_of(document);
}

}  // namespace

void write_parameters(Node refs, const profile::Profile& profile) {
  const profile::Bus& bus = profile.bus;
  const std::string_view address = bus.request_byte ? "extended" : "normal";
  const int bits = bus.extended_ids ? 29 : 11;
  const std::string request = fmt::format("{} segmented {}-bit transmit with FC", address, bits);
  const auto byte = [](std::optional<std::uint8_t> value) { return std::to_string(value.value_or(0)); };
  constexpr std::string_view no_identifier = "4294967295";  // as the standard has it
  const std::vector<std::string> table{request,
                                       std::to_string(bus.request),
                                       byte(bus.request_byte),
                                       fmt::format("{} segmented {}-bit receive with FC", address, bits),
                                       std::to_string(bus.response),
                                       byte(bus.response_byte),
                                       fmt::format("{} unsegmented {}-bit receive", address, bits),
                                       std::string(no_identifier),
                                       "0",
                                       short_name(profile.name)};
  write_reference(refs, transport, "CP_UniqueRespIdTable", table);
  const auto one = [&](std::string_view subset, std::string_view name, const std::string& value) {
    write_reference(refs, subset, name, {&value, 1});
  };
  const auto in_us = [](double seconds) { return std::to_string(std::llround(seconds * 1e6)); };
  one(transport, "CP_CanFuncReqFormat", request);
  one(transport, "CP_CanFuncReqId", std::to_string(bus.functional));
  one(transport, "CP_CanFuncReqExtAddr", byte(bus.functional_byte));
  one(transport, "CP_BlockSize", std::to_string(bus.block_size));
  constexpr unsigned first_of_100_us = 0xF1, us_of_ms = 1000, hundred = 100;
  one(transport, "CP_StMin",
      std::to_string(bus.st_min < first_of_100_us ? bus.st_min * us_of_ms
                                                  : (bus.st_min - first_of_100_us + 1) * hundred));
  one(transport, "CP_CanFillerByte", std::to_string(bus.padding));
  one(transport, "CP_CanFillerByteHandling", "1");
  one(timing, "CP_P2Max", in_us(profile.timing.request_timeout_s));
  one(timing, "CP_P2Star", in_us(profile.timing.p2_star_s));
  one(timing, "CP_TesterPresentTime", in_us(profile.timing.tester_present_s));
}

std::string parameters_text() {
  pugi::xml_document document;
  Node spec = add_named(begin_odx(document), "COMPARAM-SPEC", parameters_name, parameters_name);
  constexpr std::string_view stack_name = "ISO_15765_3_on_ISO_15765_2";
  Node stack = add_named(add(spec, "PROT-STACKS"), "PROT-STACK", fmt::format("STACK.{}", stack_name), stack_name);
  add(stack, "PDU-PROTOCOL-TYPE", stack_name);
  add(stack, "PHYSICAL-LINK-TYPE", "ISO_11898_2_DWCAN");
  Node subsets = add(stack, "COMPARAM-SUBSET-REFS");
  for (const std::string_view subset : {timing, transport}) {
    refer(subsets, "COMPARAM-SUBSET-REF", subset, subset, "COMPARAM-SUBSET");
  }
  return text_of(document);
}

std::string transport_text() { return subset_text(transport, "TRANSPORT", transport_parameters, true); }
std::string timing_text() { return subset_text(timing, "APPLICATION", timing_parameters, false); }

}  // namespace selfcal::odx
