#include <fmt/format.h>

#include <algorithm>

#include "protocol/profile/read_profile.hpp"
#include "tools/cli/device/bus_commands.hpp"

namespace selfcal::cli::device {

Expected<profile::ProfilePtr> chosen_profile(const std::string& file) {
  if (file.empty()) {
    return profile::built_in();
  }
  auto profile = profile::load_profile(file);
  if (profile) {
    return profile;
  }
  const std::string& faults = profile.error().message;
  const auto more = std::ranges::count(faults, '\n');
  return fail(profile.error().kind,
              faults.substr(0, faults.find('\n')) +
                  (more > 0 ? fmt::format(" (and {} more: selfcal device lint)", more) : std::string()));
}

std::string cannot_try(const profile::Profile& profile) {
  if (!profile.frames) {
    return {};
  }
  return fmt::format("{}: bus.addressing: none: an INS that speaks no UDS has none of the services that are tried",
                     profile.file);
}

}  // namespace selfcal::cli::device
