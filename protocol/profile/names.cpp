#include "protocol/profile/names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/profile/status_frames.hpp"

namespace selfcal::profile {
namespace {

std::vector<std::pair<std::uint16_t, std::string>> dids_of(const Profile& p) {
  std::vector<std::pair<std::uint16_t, std::string>> dids;
  for (const auto& [name, did] :
       {std::pair("identity.serial", std::optional(p.serial)),
        std::pair("identity.software", std::optional(p.software)), std::pair("state", p.state.did),
        std::pair("schedule", p.schedule.did), std::pair("move", p.move ? p.move->did : std::nullopt),
        std::pair("site", p.site.did), std::pair("directory", p.directory.did),
        std::pair("sample_format", p.sample_format.did), std::pair("coefficients.in_force", p.set_in_force),
        std::pair("coefficients.inactive", p.set_inactive), std::pair("coefficients.factory", p.set_factory)}) {
    if (did) {
      dids.emplace_back(*did, name);
    }
  }
  for (const Field& field : p.set.fields) {
    if (field.did) {
      dids.emplace_back(*field.did, "coefficients." + field.name);
    }
  }
  return dids;
}

std::vector<std::pair<std::uint16_t, std::string>> routines_of(const Profile& p) {
  std::vector<std::pair<std::uint16_t, std::string>> routines;
  for (const auto& [name, id] : {std::pair("rotate", p.rotate.id), std::pair("erase", p.erase.id),
                                 std::pair("commit", p.commit.id), std::pair("navigation_check", p.navigation_check.id),
                                 std::pair("move", p.move ? p.move->routine : std::nullopt)}) {
    if (id) {
      routines.emplace_back(*id, name);
    }
  }
  return routines;
}

}  // namespace

std::string did_name(const Profile& p, std::uint16_t did) {
  const auto dids = dids_of(p);
  const auto found = std::ranges::find(dids, did, &std::pair<std::uint16_t, std::string>::first);
  return found == dids.end() ? fmt::format("0x{:04X}", did) : found->second;
}

std::string routine_name(const Profile& p, std::uint16_t routine) {
  const auto routines = routines_of(p);
  const auto found = std::ranges::find(routines, routine, &std::pair<std::uint16_t, std::string>::first);
  return found == routines.end() ? fmt::format("0x{:04X}", routine) : found->second;
}

uds::DecoderOptions decoder_options(const ProfilePtr& profile) {
  const Bus& bus = profile->bus;
  uds::DecoderOptions options;
  options.request_id = bus.request;
  options.response_id = bus.response;
  options.functional_id = bus.functional;
  options.extended = bus.extended_ids;
  options.request_byte = bus.request_byte;
  options.response_byte = bus.response_byte;
  options.functional_byte = bus.functional_byte;
  for (auto& [did, name] : dids_of(*profile)) {
    if (const Region* region = profile->memory.find(did)) {
      options.names.memory.push_back({region->address, region->end(), std::move(name)});
    } else {
      options.names.dids.emplace(did, std::move(name));
    }
  }
  for (auto& [routine, name] : routines_of(*profile)) {
    options.names.routines.emplace(routine, std::move(name));
  }
  for (const std::uint16_t did : {profile->serial, profile->software}) {
    if (profile->memory.find(did) == nullptr) {
      options.names.texts.insert(did);
    }
  }
  if (profile->raw.way == Raw::Way::memory) {
    options.names.memory.push_back({profile->raw.first_address, profile->raw.end_address, "raw data"});
  }
  options.names.upload_by_page = profile->raw.by_page;
  options.status = [profile](const can::CanFrame& frame) {
    std::vector<uds::LogEntry::Signal> signals;
    for (NamedValue& value : status_values(*profile, frame)) {
      signals.push_back({std::move(value.name), value.value, std::move(value.text)});
    }
    return signals;
  };
  return options;
}

}  // namespace selfcal::profile
