// The parts of `selfcal device` that speak to an INS.
#pragma once

#include <string>

#include "protocol/error.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::cli::device {

// As an error is told: one line. Our own INS's where no file is named.
[[nodiscard]] Expected<profile::ProfilePtr> chosen_profile(const std::string& file);

// Why `check` and `probe` cannot ask such an INS; empty: they can.
std::string cannot_try(const profile::Profile& profile);

struct CheckArguments {
  std::string interface, profile, key_file;
  bool write = false, json = false, all = false;
};
[[nodiscard]] Expected<int> check(const CheckArguments& arguments);

struct ProbeArguments {
  std::string interface, profile;
  std::uint32_t first_did = 0xF180, last_did = 0xF19F;
  double listen_s = 2.0;
  bool only = false, json = false;
};
[[nodiscard]] Expected<int> probe(const ProbeArguments& arguments);

}  // namespace selfcal::cli::device
