// ReadDataByIdentifier and ReadMemoryByAddress: every record of the profile, and what is none.
#include <fmt/format.h>

#include <algorithm>

#include "protocol/profile/records.hpp"
#include "protocol/uds/messages.hpp"
#include "tools/cli/device/record_access.hpp"
#include "tools/cli/device/unused_number.hpp"

namespace selfcal::cli::device {
namespace {

using uds::Nrc;
constexpr std::string_view clause = "ISO 14229-1, 10.2", memory_clause = "ISO 14229-1, 10.3";

// In memory it has a fixed length: what fills it up is no text.
std::string fault_of_text(ByteView record, bool filled) {
  const auto fills = [](std::uint8_t b) { return b == 0 || b == 0xFF || b == ' '; };
  while (filled && !record.empty() && fills(record.back())) {
    record = record.first(record.size() - 1);
  }
  for (const std::uint8_t byte : record) {
    if (byte != 0 && (byte < 0x20 || byte > 0x7E)) {
      return "not printable ASCII";
    }
  }
  return record.empty() ? "empty" : "";
}

template <typename Record>
std::string fault_of(const Expected<Record>& record) {
  return record ? "" : record.error().message;
}

std::string fault_of_set(const profile::Profile& p, ByteView record) {
  const auto set = profile::decode_coefficients(p, record);
  if (!set) {
    return set.error().message;
  }
  return profile::checksum_holds(p.set, record) ? "" : "wrong checksum";
}

// A record that the INS may not have yet: conditionsNotCorrect then.
enum class May : std::uint8_t { be_there, be_absent };

void try_record(Conformance& c, std::string_view record_name, std::optional<std::uint16_t> did, May may,
                const Conformance::Judge& judge) {
  if (!did) {
    return;
  }
  const std::string id = fmt::format("read.{}", record_name);
  const std::string sentence =
      fmt::format("{} is read in the default session, as the profile lays it out.", record_name);
  const Requirement requirement{id, in_memory(c.profile(), *did) ? memory_clause : clause, sentence};
  if (!c.ready(requirement)) {
    return;
  }
  const RecordExchange told = read_record(c, *did);
  const bool none = told.exchange.kind == Exchange::Kind::negative &&
                    told.exchange.nrc == static_cast<std::uint8_t>(Nrc::conditions_not_correct);
  const bool blank = told.record && std::ranges::all_of(*told.record, [](std::uint8_t b) { return b == 0xFF; });
  const bool absent = may == May::be_absent && (none || blank);
  const std::string fault = absent ? "" : told.record ? judge(*told.record) : told.record.error().message;
  c.judged(requirement, told.sent,
           may == May::be_there ? "the record" : "the record, or conditionsNotCorrect (0x22) where there is none",
           came(told, fault), fault.empty());
}

// Where records stand in memory.
void try_refusals_of_memory(Conformance& c) {
  const profile::Profile& p = c.profile();
  if (p.memory.regions.empty()) {
    return;
  }
  const Bytes request = read_request_of(p, p.memory.regions.begin()->first);
  Bytes shorter = request, longer = request, other = request;
  shorter.pop_back();
  longer.push_back(0);
  other[1] = 0x11;
  c.refused({"read.memory_short", memory_clause, "An address and size that are too short are refused."}, shorter,
            {Nrc::incorrect_message_length, Nrc::request_out_of_range});
  c.refused({"read.memory_long", memory_clause, "An address and size with a byte too many are refused."}, longer,
            {Nrc::incorrect_message_length, Nrc::request_out_of_range});
  c.refused({"read.memory_format", memory_clause, "Another format of address and size is refused."}, other,
            {Nrc::request_out_of_range, Nrc::incorrect_message_length});
}

// An identifier that a record has, if any has one.
std::optional<std::uint16_t> some_identifier(const profile::Profile& p) {
  for (const auto& did : {std::optional(p.serial), std::optional(p.software), p.state.did, p.set_in_force}) {
    if (did && !in_memory(p, *did)) {
      return did;
    }
  }
  return std::nullopt;
}

void try_refusals_of_identifiers(Conformance& c) {
  const auto did = some_identifier(c.profile());
  if (!did) {
    return;
  }
  c.refused({"read.unknown", clause, "An identifier that is none is refused."}, uds::read_request(unused_did),
            {Nrc::request_out_of_range});
  c.refused({"read.too_short", clause, "Half an identifier is refused."}, Bytes{0x22, 0xF1},
            {Nrc::incorrect_message_length});
  Bytes longer = uds::read_request(*did);
  longer.push_back(0);
  c.refused({"read.too_long", clause, "An identifier and a half are refused."}, longer,
            {Nrc::incorrect_message_length});
}

}  // namespace

void try_records(Conformance& c) {
  const profile::Profile& p = c.profile();
  for (const auto& [name, did] : {std::pair("serial", p.serial), std::pair("software", p.software)}) {
    try_record(c, name, did, May::be_there,
               [filled = in_memory(p, did)](ByteView b) { return fault_of_text(b, filled); });
  }
  try_record(c, "state", p.state.did, May::be_there, [&](ByteView b) { return fault_of(profile::decode_state(p, b)); });
  try_record(c, "schedule", p.schedule.did, May::be_absent,
             [&](ByteView b) { return fault_of(profile::decode_schedule(p, b)); });
  try_record(c, "site", p.site.did, May::be_there, [&](ByteView b) { return fault_of(profile::decode_site(p, b)); });
  try_record(c, "directory", profile::told_directory(p), May::be_there,
             [&](ByteView b) { return fault_of(profile::decode_directory(p, b)); });
  try_record(c, "sample_format", p.sample_format.did, May::be_there,
             [&](ByteView b) { return fault_of(profile::decode_sample_format(p, b)); });
  const auto of_set = [&](ByteView b) { return fault_of_set(p, b); };
  try_record(c, "set_in_force", p.set_in_force, May::be_there, of_set);
  try_record(c, "set_inactive", p.set_inactive, May::be_absent, of_set);
  try_record(c, "set_factory", p.set_factory, May::be_absent, of_set);

  for (const profile::Field& field : p.set.fields) {
    try_record(c, field.name, field.did, May::be_there, [&](ByteView b) -> std::string {
      const std::size_t bytes = field.end() - field.at;
      return b.size() == bytes ? "" : fmt::format("{} bytes, {} expected", b.size(), bytes);
    });
  }
  try_refusals_of_identifiers(c);
  try_refusals_of_memory(c);
  if (p.bus.status) {
    constexpr Requirement status{"status.frame", "profile, bus.status", "The state frame comes by itself."};
    constexpr double within_s = 3.0;
    const auto frame = c.tester().other(*p.bus.status, within_s);
    c.judged(status, "nothing", fmt::format("a frame with identifier {:X} within {:g} s", *p.bus.status, within_s),
             frame ? hex(frame->payload()) : "nothing", frame.has_value());
  }
}

}  // namespace selfcal::cli::device
