// The messages of a DBC: where their signals stand. What else a DBC may hold is passed over.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "protocol/error.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

struct DbcMessage {
  std::uint32_t id = 0;
  bool extended = false;
  std::size_t bytes = 0;
  std::map<std::string, Signal, std::less<>> signals;  // scale, offset and unit as the DBC has them
};
using Dbc = std::map<std::string, DbcMessage, std::less<>>;

// Fails (bad_input) with "FILE:LINE: what".
[[nodiscard]] Expected<Dbc> parse_dbc(std::string_view text, const std::string& file);
[[nodiscard]] Expected<Dbc> load_dbc(const std::string& file);

// The frames of an INS that speaks no UDS. Commands that share an identifier are one message, told apart by a multiplexor.
std::string frames_dbc(const Profile& profile);

// The identifiers of an INS and its status frames; of one without UDS, all its frames.
std::string dbc_text(const Profile& profile);

}  // namespace selfcal::profile
