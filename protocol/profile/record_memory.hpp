// Records that an INS has in its memory in place of data identifiers: read by ReadMemoryByAddress, written by
// WriteMemoryByAddress.
//
// Everything that asks for a record asks by a number. A record in memory has one that ISO 14229-1 (table C.1) reserves, so that no
// INS has it as an identifier; what goes over the bus is made of its region, here and nowhere else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "protocol/uds/messages.hpp"

namespace selfcal::profile {

inline constexpr std::uint16_t first_region_number = 0x0001, last_region_number = 0x00FF;

struct Region {
  std::uint32_t address = 0;
  std::uint32_t bytes = 0;
  std::uint64_t end() const { return std::uint64_t{address} + bytes; }
};

// A part of a region that one request reads or writes.
struct RegionPart {
  std::uint32_t address = 0;
  std::uint32_t bytes = 0;
};

struct RecordMemory {
  std::size_t address_bytes = 4, size_bytes = 2;
  std::uint32_t longest_read = 0, longest_write = 0;  // bytes that the INS tells and takes at once
  std::map<std::uint16_t, Region> regions;            // by number

  uds::UploadFormat format() const { return {address_bytes, size_bytes}; }
  const Region* find(std::uint16_t number) const;
  // The number of the region that has all of these bytes.
  std::optional<std::uint16_t> holding(std::uint64_t address, std::uint64_t bytes) const;
  uds::Bytes read_request(const RegionPart& part) const;
  uds::Bytes write_request(const RegionPart& part, uds::ByteView record, const Region& region) const;
};

// In order, none longer than `longest`.
std::vector<RegionPart> parts_of(const Region& region, std::uint32_t longest);

}  // namespace selfcal::profile
