// A profile as ODX 2.2 (ISO 22901-1), the form in which other diagnostic tools take an ECU's interface; in a PDX, their archive.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::odx {

struct Export {
  std::vector<std::pair<std::string, std::string>> files;  // name in the archive, text
  std::size_t services = 0;
  std::vector<std::string> lost;  // what ODX cannot hold, a sentence each
};

// Fails (bad_input) on an INS that speaks no UDS.
[[nodiscard]] Expected<Export> export_profile(const profile::Profile& profile);

// Replaces what is there.
[[nodiscard]] Expected<void> write_pdx(const Export& made, const std::string& path);

}  // namespace selfcal::odx
