// What this software needs to know of an INS, record by record: THE table that a profile is checked against, and from which
// its reference is written.
#pragma once

#include <span>
#include <string_view>

namespace selfcal::profile {

struct RoleField {
  std::string_view name;
  std::string_view unit;  // of the value in this software; the INS may use any other of the same quantity
  bool needed = false;
  std::string_view meaning;
  std::span<const std::string_view> words{};  // of an enumeration, its numbers being 0, 1, 2, ...
  std::size_t count = 1;                      // elements
  bool repeated = false;
  bool text = false;
};

struct RecordRole {
  std::string_view table;  // of the profile: "state", "rotate.start"
  std::string_view meaning;
  std::span<const RoleField> fields;
  bool needed = true;
};
std::span<const RecordRole> record_roles();
const RecordRole& record_role(std::string_view table);  // aborts on a table that is none

struct Unit {
  std::string_view name;
  std::string_view quantity;  // "angle"
  double si = 1.0;            // of one
};
std::span<const Unit> units();
const Unit* find_unit(std::string_view name);

}  // namespace selfcal::profile
