// Where a profile says that records stand in the INS's memory: taken one by one while it is read, judged when all is known.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "protocol/profile/profile.hpp"
#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {

class RegionReader {
 public:
  RegionReader(Faults& faults, RecordMemory& memory) : faults_(faults), memory_(memory) {}

  // The number that the record at this address is asked for by. None, and a fault, where there are too many.
  std::optional<std::uint16_t> take(std::size_t line, const std::string& path, std::uint64_t address);
  // By the key `memory`, if the section has it.
  std::optional<std::uint16_t> take(Section& section);
  void give_length(std::optional<std::uint16_t> number, std::size_t bytes);

  // [memory] was read, and the raw data. Of two that overlap both are told.
  void check(const Section& root, const Raw& raw);

 private:
  struct Place {
    std::size_t line = 0;
    std::string path;
  };
  void check_one(const Section& root, std::uint16_t number, const Region& region);
  void check_pair(std::uint16_t number, std::uint16_t other);

  Faults& faults_;
  RecordMemory& memory_;
  std::map<std::uint16_t, Place> places_;
};

}  // namespace selfcal::profile
