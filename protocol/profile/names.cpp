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
        std::pair("schedule", p.schedule.did), std::pair("site", p.site.did), std::pair("directory", p.directory.did),
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

std::array<std::pair<const char*, const Routine*>, 4> routines_of(const Profile& p) {
  return {
      {{"rotate", &p.rotate}, {"erase", &p.erase}, {"commit", &p.commit}, {"navigation_check", &p.navigation_check}}};
}

}  // namespace

std::string did_name(const Profile& p, std::uint16_t did) {
  const auto dids = dids_of(p);
  const auto found = std::ranges::find(dids, did, &std::pair<std::uint16_t, std::string>::first);
  return found == dids.end() ? fmt::format("0x{:04X}", did) : found->second;
}

std::string routine_name(const Profile& p, std::uint16_t routine) {
  for (const auto& [name, own] : routines_of(p)) {
    if (own->id == routine) {
      return name;
    }
  }
  return fmt::format("0x{:04X}", routine);
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
    options.names.dids.emplace(did, std::move(name));
  }
  for (const auto& [name, routine] : routines_of(*profile)) {
    if (routine->id) {
      options.names.routines.emplace(*routine->id, name);
    }
  }
  options.names.texts = {profile->serial, profile->software};
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
