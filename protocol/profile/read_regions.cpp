#include "protocol/profile/read_regions.hpp"

#include <fmt/format.h>

namespace selfcal::profile {
namespace {

constexpr std::uint64_t largest_address = 0xFFFFFFFF;

std::string words_of(const Region& region) { return fmt::format("0x{:X} to 0x{:X}", region.address, region.end() - 1); }

}  // namespace

std::optional<std::uint16_t> RegionReader::take(std::size_t line, const std::string& path, std::uint64_t address) {
  const std::size_t number = first_region_number + places_.size();
  if (number > last_region_number) {
    faults_.add(line, path, fmt::format("{} records in memory are the most", last_region_number));
    return std::nullopt;
  }
  const auto taken = static_cast<std::uint16_t>(number);
  places_.emplace(taken, Place{line, path});
  memory_.regions.emplace(taken, Region{static_cast<std::uint32_t>(address), 0});
  return taken;
}

std::optional<std::uint16_t> RegionReader::take(Section& section) {
  const auto address = section.whole("memory", 0, largest_address);
  return address ? take(section.line_of("memory"), section.path_of("memory"), *address) : std::nullopt;
}

void RegionReader::give_length(std::optional<std::uint16_t> number, std::size_t bytes) {
  if (const auto region = memory_.regions.find(number.value_or(0)); region != memory_.regions.end()) {
    region->second.bytes = static_cast<std::uint32_t>(bytes);
  }
}

void RegionReader::check_one(const Section& root, std::uint16_t number, const Region& region) {
  const Place& place = places_.at(number);
  if (!root.has("memory")) {
    return faults_.add(place.line, place.path,
                       "needs [memory] with address_bytes, size_bytes and longest: how the INS's memory is asked for");
  }
  if (region.bytes > 0 && ((region.end() - 1) >> (8 * memory_.address_bytes)) != 0) {
    faults_.add(place.line, place.path,
                fmt::format("bytes {} do not fit an address of {} bytes (memory.address_bytes)", words_of(region),
                            memory_.address_bytes));
  }
}

void RegionReader::check_pair(std::uint16_t number, std::uint16_t other) {
  const Region &a = memory_.regions.at(number), &b = memory_.regions.at(other);
  if (a.address >= b.end() || b.address >= a.end()) {
    return;
  }
  const auto tell = [&](std::uint16_t at, std::uint16_t with, const Region& region) {
    faults_.add(
        places_.at(at).line, places_.at(at).path,
        fmt::format("overlaps {} (line {}), bytes {}", places_.at(with).path, places_.at(with).line, words_of(region)));
  };
  tell(number, other, b);
  tell(other, number, a);
}

void RegionReader::check(const Section& root, const Raw& raw) {
  for (const auto& [number, region] : memory_.regions) {
    check_one(root, number, region);
    for (auto other = memory_.regions.begin(); other->first != number; ++other) {
      check_pair(number, other->first);
    }
    const bool of_raw = raw.way == Raw::Way::memory && region.bytes > 0 && region.address < raw.end_address &&
                        region.end() > raw.first_address;
    if (of_raw) {
      faults_.add(places_.at(number).line, places_.at(number).path,
                  fmt::format("bytes {} overlap the raw data, which stand from 0x{:X} to 0x{:X} (memory, line {})",
                              words_of(region), raw.first_address, raw.end_address - 1, root.line_of("memory")));
    }
  }
}

}  // namespace selfcal::profile
