// What our codec makes of records: usage decode_by_profile PROFILE < LINES, each line "KIND NUMBER BYTES" in hexadecimal digits, KIND being
// did, option (of a routine) or result. A line of JSON for each: values in SI units, words of enumerations, texts.
#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "protocol/profile/coefficient_fields.hpp"
#include "protocol/profile/read_profile.hpp"

namespace selfcal::profile {
namespace {

struct Known {
  Layout layout;
  const RecordRole* role = nullptr;
};

std::optional<Known> known(const Profile& p, const std::string& kind, std::uint16_t number) {
  if (kind != "did") {
    for (const auto& [table, routine] :
         {std::pair("rotate", &p.rotate), std::pair("erase", &p.erase), std::pair("commit", &p.commit),
          std::pair("navigation_check", &p.navigation_check)}) {
      const Layout& layout = kind == "option" ? routine->start : routine->result;
      if (routine->id == number && !layout.fields.empty()) {
        return Known{layout, &record_role(fmt::format("{}.{}", table, kind == "option" ? "start" : "result"))};
      }
    }
    return std::nullopt;
  }
  for (const auto& [table, record] :
       {std::pair("state", &p.state), std::pair("schedule", &p.schedule), std::pair("site", &p.site),
        std::pair("directory", &p.directory), std::pair("sample_format", &p.sample_format)}) {
    if (record->did == number) {
      return Known{record->layout, &record_role(table)};
    }
  }
  for (const Field& field : p.set.fields) {
    if (field.did == number) {
      Layout alone;
      alone.record = field.name;
      alone.fields.push_back(field);
      alone.fields[0].at = 0;
      alone.bytes = alone.fields[0].end();
      return Known{alone, &set_role()};
    }
  }
  const bool of_set = p.set_in_force == number || p.set_inactive == number || p.set_factory == number;
  return of_set ? std::optional(Known{p.set, &set_role()}) : std::nullopt;
}

nlohmann::json values_of(const Known& k, const Values& values) {
  nlohmann::json all = nlohmann::json::object();
  for (const auto& [name, numbers] : values.numbers) {
    const auto role = std::ranges::find(k.role->fields, name, &RoleField::name);
    if (role == k.role->fields.end()) {
      continue;
    }
    nlohmann::json list = nlohmann::json::array();
    for (const long double number : numbers) {
      if (!role->words.empty()) {
        list.push_back(role->words[static_cast<std::size_t>(number)]);
      } else {
        list.push_back(static_cast<double>(number * find_unit(role->unit)->si));
      }
    }
    all[name] = std::move(list);
  }
  for (const auto& [name, text] : values.texts) {
    all[name] = {text};
  }
  return all;
}

Bytes bytes_of(const std::string& digits) {
  Bytes bytes;
  for (std::size_t k = 0; k + 1 < digits.size(); k += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(digits.substr(k, 2), nullptr, 16)));
  }
  return bytes;
}

int decode(const Profile& profile) {
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string kind, number, digits;
    words >> kind >> number >> digits;
    const auto k = known(profile, kind, static_cast<std::uint16_t>(std::stoul(number, nullptr, 16)));
    const auto values = k ? read_fields(k->layout, bytes_of(digits)) : tl::unexpected(Error{ErrorKind::usage, "none"});
    fmt::print("{}\n", values ? values_of(*k, *values).dump() : "null");
  }
  return 0;
}

}  // namespace
}  // namespace selfcal::profile

int main(int argc, char** argv) {
  const auto profile = selfcal::profile::load_profile(argc > 1 ? argv[1] : "");
  if (!profile) {
    fmt::print(stderr, "{}\n", profile.error().message);
    return 3;
  }
  return selfcal::profile::decode(**profile);
}
