// selfcal device probe: what a probe found, as text and as JSON.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocol/document/document_head.hpp"
#include "protocol/uds/messages.hpp"
#include "protocol/uds/services.hpp"
#include "tools/cli/device/bus_commands.hpp"
#include "tools/cli/device/probe.hpp"

namespace selfcal::cli::device {
namespace {

std::string id_text(std::uint32_t id, bool extended) { return fmt::format("0x{:0{}X}", id, extended ? 8 : 3); }

// Where diagnostics are asked for: ISO 15765-4 with 11 bits, and normal fixed addressing with the tester's address 0xF1.
std::vector<Address> usual_addresses() {
  std::vector<Address> list;
  for (std::uint32_t id = 0x7E0; id <= 0x7E7; ++id) {
    list.push_back({id, 0, false, {}, {}});
  }
  for (std::uint32_t node = 0; node <= 0xFF; ++node) {
    if (node != 0xF1) {
      list.push_back({0x18DA00F1 | node << 8U, 0, true, {}, {}});
    }
  }
  return list;
}

// With the address byte behind it, where there is one.
std::string address_text(std::uint32_t id, bool extended, std::optional<std::uint8_t> byte) {
  return byte ? fmt::format("{} address {:02X}", id_text(id, extended), *byte) : id_text(id, extended);
}

// What fills a text up is left out.
std::string ascii(ByteView record) {
  const auto fills = [](std::uint8_t b) { return b == 0 || b == 0xFF || b == ' '; };
  ByteView bytes = record;
  while (!bytes.empty() && fills(bytes.back())) {
    bytes = bytes.first(bytes.size() - 1);
  }
  const bool printable =
      !bytes.empty() && std::ranges::all_of(bytes, [](std::uint8_t b) { return b >= 0x20 && b <= 0x7E; });
  return printable ? fmt::format(" \"{}\"", std::string(bytes.begin(), bytes.end())) : "";
}

std::string timings_text(const Found& found) {
  const auto timings = uds::read_session_response(found.session, uds::Session::standard);
  return timings
             ? fmt::format("default session, P2 {:g} s, P2* {:g} s", std::chrono::duration<double>(timings->p2).count(),
                           std::chrono::duration<double>(timings->p2_star).count())
             : fmt::format("default session: {}", found.session.empty() ? "no answer" : hex(found.session));
}

std::string record_text(const Bytes& record, std::uint8_t nrc) {
  if (record.empty()) {
    return nrc == 0 ? "no answer that makes sense" : uds::describe_nrc(nrc);
  }
  constexpr std::size_t shown = 16;
  return fmt::format("{} bytes: {:02X}{}{}", record.size(),
                     fmt::join(ByteView(record).first(std::min(record.size(), shown)), " "),
                     record.size() > shown ? " ..." : "", ascii(record));
}

void print(const ProbePlan& plan, const ProbeResult& result) {
  for (const Heard& heard : result.heard) {
    fmt::print("heard     {}: {} frames in {:g} s, the last {:02X}\n", id_text(heard.id, heard.extended_ids),
               heard.frames, plan.listen_s, fmt::join(heard.last, " "));
  }
  for (const Found& found : result.found) {
    const Address& a = found.address;
    fmt::print("answers   request {}, response {}: {}; {}\n", address_text(a.request, a.extended_ids, a.request_byte),
               address_text(a.response, a.extended_ids, a.response_byte), hex(found.present), timings_text(found));
    for (const Known& known : found.dids) {
      fmt::print("  {:04X}    {}\n", known.did, record_text(known.record, known.nrc));
    }
    for (const KnownPlace& place : found.memory) {
      fmt::print("  {:08X}  {}: {}\n", place.address, place.name, record_text(place.record, place.nrc));
    }
  }
  fmt::print("{} address{} answered\n", result.found.size(), result.found.size() == 1 ? "" : "es");
}

std::string document_of(const ProbePlan& plan, const ProbeResult& result) {
  using Json = nlohmann::ordered_json;
  Json heard = Json::array(), found = Json::array();
  for (const Heard& one : result.heard) {
    heard.push_back({{"id", one.id},
                     {"extended_id", one.extended_ids},
                     {"frames", one.frames},
                     {"last", fmt::format("{:02X}", fmt::join(one.last, ""))}});
  }
  for (const Found& one : result.found) {
    Json dids = Json::array();
    for (const Known& known : one.dids) {
      Json item{{"did", known.did}};
      known.record.empty() ? item["nrc"] = known.nrc
                           : item["record"] = fmt::format("{:02X}", fmt::join(known.record, ""));
      dids.push_back(std::move(item));
    }
    Json memory = Json::array();
    for (const KnownPlace& place : one.memory) {
      Json item{{"address", place.address}, {"name", place.name}};
      place.record.empty() ? item["nrc"] = place.nrc
                           : item["record"] = fmt::format("{:02X}", fmt::join(place.record, ""));
      memory.push_back(std::move(item));
    }
    Json address{{"request_id", one.address.request},
                 {"response_id", one.address.response},
                 {"extended_id", one.address.extended_ids}};
    if (one.address.request_byte && one.address.response_byte) {
      address["request_address"] = *one.address.request_byte;
      address["response_address"] = *one.address.response_byte;
    }
    address.update({{"tester_present", fmt::format("{:02X}", fmt::join(one.present, ""))},
                    {"default_session", fmt::format("{:02X}", fmt::join(one.session, ""))},
                    {"dids", std::move(dids)}});
    if (!memory.empty()) {
      address["memory"] = std::move(memory);
    }
    found.push_back(std::move(address));
  }
  return document::with_head(document::probe, {{"interface", plan.interface},
                                               {"listened_s", plan.listen_s},
                                               {"first_did", plan.first_did},
                                               {"last_did", plan.last_did},
                                               {"heard", std::move(heard)},
                                               {"found", std::move(found)}})
      .dump();
}

}  // namespace

Expected<int> probe(const ProbeArguments& arguments) {
  const auto profile = chosen_profile(arguments.profile);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  if (const std::string why = cannot_try(**profile); !why.empty()) {
    return fail(ErrorKind::bad_input, why);
  }
  if (arguments.last_did > 0xFFFF) {
    return fail(ErrorKind::usage,
                fmt::format("--last-did is 0x{:X}, 0xFFFF is the last identifier", arguments.last_did));
  }
  if (arguments.first_did > arguments.last_did) {
    return fail(ErrorKind::usage, fmt::format("--first-did is 0x{:04X}, above --last-did, 0x{:04X}",
                                              arguments.first_did, arguments.last_did));
  }
  ProbePlan plan{arguments.interface,
                 **profile,
                 {},
                 static_cast<std::uint16_t>(arguments.first_did),
                 static_cast<std::uint16_t>(arguments.last_did),
                 arguments.listen_s};
  if (!arguments.only) {
    plan.addresses = usual_addresses();
  }
  const auto result = probe(plan);
  if (!result) {
    return tl::unexpected(result.error());
  }
  if (arguments.json) {
    fmt::print("{}\n", document_of(plan, *result));
  } else {
    print(plan, *result);
  }
  return result->found.empty() ? 1 : 0;
}

}  // namespace selfcal::cli::device
