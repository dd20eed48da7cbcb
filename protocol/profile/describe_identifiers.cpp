#include "protocol/profile/describe_identifiers.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace selfcal::profile {
namespace {

struct Content {
  std::uint16_t did = 0;
  std::string words, access;
};

std::vector<Content> contents_of(const Profile& p) {
  std::vector<Content> contents;
  const auto add = [&](std::optional<std::uint16_t> did, std::string_view words, std::string_view access) {
    if (did) {
      contents.push_back({*did, std::string(words), std::string(access)});
    }
  };
  add(p.serial, "serial number, ASCII", "read");
  add(p.software, "software version, ASCII", "read");
  add(p.state.did, "state", "read");
  add(p.schedule.did, "schedule", "read, write");
  add(p.move ? p.move->did : std::nullopt, "move", "write");
  add(p.site.did, "site", "read");
  add(told_directory(p), "directory", "read");
  add(p.sample_format.did, "sample format", "read");
  add(p.set_in_force,
      p.slots ? "coefficients in force, as taken at power-on" : "coefficients, used from the next power-on on",
      p.slots ? "read" : "read, write");
  for (const Field& field : p.set.fields) {
    add(field.did, fmt::format("coefficients: {}", field.name), "read, write");
  }
  add(p.set_inactive, "coefficients in the slot not in force; erased: negative response 0x22, or all 0xFF",
      "read, write");
  add(p.set_factory, "coefficients of the factory", "read");
  return contents;
}

bool in_memory(const Profile& p, const Content& content) { return p.memory.find(content.did) != nullptr; }

void describe_memory(Writer& out, const Profile& p, const std::vector<Content>& contents) {
  const RecordMemory& memory = p.memory;
  out.heading("Records in memory");
  out.say(fmt::format(
      "Each stands at its address always. It is read by 23 and written by 3D, {} bytes at most in one request that "
      "reads "
      "and {} in one that writes; a longer one in parts, in order from its first byte on. The tester writes every part "
      "and reads the record back: whether the INS takes it part by part or with the last one is its own matter. A text "
      "is filled up with 0, 0xFF or blanks.",
      memory.longest_read, memory.longest_write));
  out.say(fmt::format(
      "Refused are: another format than {:X}{:X}, bytes that are in no record{} and a record that is only read where "
      "it "
      "is written, all of them with 0x31; a request that is shorter or longer than its format and SIZE say, with 0x13; "
      "any write in the default session, with 0x7F{}.",
      memory.size_bytes, memory.address_bytes, p.raw.way == Raw::Way::memory ? " and in no page of raw data" : "",
      p.security.needed ? ", and while the lock is closed, with 0x33" : ""));
  std::vector<Row> rows;
  for (const Content& content : contents) {
    if (const Region* region = memory.find(content.did)) {
      rows.push_back(
          {fmt::format("0x{:X}", region->address), std::to_string(region->bytes), content.words, content.access});
    }
  }
  out.table({"address", "bytes", "content", "access"}, rows);
}

}  // namespace

std::string place_text(const Profile& profile, std::uint16_t did) {
  const Region* region = profile.memory.find(did);
  return region == nullptr ? fmt::format("identifier 0x{:04X}", did) : fmt::format("address 0x{:X}", region->address);
}

std::vector<Row> rows_of_reading(const Profile& p) {
  const auto contents = contents_of(p);
  std::vector<Row> rows;
  const auto by_did = [&](const Content& content) { return !in_memory(p, content); };
  if (std::ranges::any_of(contents, by_did)) {
    rows.push_back({"22 DID", "62 DID RECORD", "read, in any session; DID has two bytes, big-endian"});
  }
  if (std::ranges::any_of(contents, [&](const Content& c) { return by_did(c) && is_written(p, c.did); })) {
    rows.push_back({"2E DID RECORD", "6E DID", "write"});
  }
  if (p.memory.regions.empty()) {
    return rows;
  }
  const RecordMemory& memory = p.memory;
  const std::string format = fmt::format("{:X}{:X}", memory.size_bytes, memory.address_bytes);
  rows.push_back(
      {fmt::format("23 {} ADDRESS SIZE", format), "63 DATA",
       fmt::format("read records in memory, in any session; ADDRESS has {} bytes, SIZE {}, big-endian; DATA: "
                   "SIZE bytes from ADDRESS on",
                   memory.address_bytes, memory.size_bytes)});
  rows.push_back({fmt::format("3D {} ADDRESS SIZE DATA", format), fmt::format("7D {} ADDRESS SIZE", format),
                  "write records in memory: SIZE bytes of DATA, from ADDRESS on"});
  return rows;
}

void describe_identifiers(Writer& out, const Profile& p) {
  const auto contents = contents_of(p);
  std::vector<Row> rows;
  for (const Content& content : contents) {
    if (!in_memory(p, content)) {
      rows.push_back({fmt::format("0x{:04X}", content.did), content.words, content.access});
    }
  }
  if (!rows.empty()) {
    out.heading("Data identifiers");
    out.table({"DID", "content", "access"}, rows);
  }
  if (!p.memory.regions.empty()) {
    describe_memory(out, p, contents);
  }
}

}  // namespace selfcal::profile
