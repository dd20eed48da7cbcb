#include "protocol/profile/record_memory.hpp"

#include <algorithm>

#include "protocol/profile/frame_values.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

const Region* RecordMemory::find(std::uint16_t number) const {
  const auto found = regions.find(number);
  return found == regions.end() ? nullptr : &found->second;
}

std::optional<std::uint16_t> RecordMemory::holding(std::uint64_t address, std::uint64_t bytes) const {
  const auto found = std::ranges::find_if(regions, [&](const auto& numbered) {
    const Region& region = numbered.second;
    return address >= region.address && address + bytes <= region.end();
  });
  return found == regions.end() ? std::nullopt : std::optional(found->first);
}

uds::Bytes RecordMemory::read_request(const RegionPart& part) const {
  return uds::memory_request(part.address, part.bytes, format());
}

uds::Bytes RecordMemory::write_request(const RegionPart& part, uds::ByteView record, const Region& region) const {
  return uds::write_memory_request(part.address, record.subspan(part.address - region.address, part.bytes), format());
}

bool is_written(const Profile& p, std::uint16_t did) {
  const bool of_set =
      p.slots ? did == p.set_inactive : did == p.set_in_force || (p.field_by_field && field_of(p, did) != nullptr);
  return of_set || did == p.schedule.did || (p.move && did == p.move->did);
}

std::vector<RegionPart> parts_of(const Region& region, std::uint32_t longest) {
  std::vector<RegionPart> parts;
  for (std::uint32_t done = 0; done < region.bytes; done += parts.back().bytes) {
    parts.push_back({region.address + done, std::min(longest, region.bytes - done)});
  }
  return parts;
}

}  // namespace selfcal::profile
