// The DBC of the status frames and the diagnostic identifiers, from the table.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/ins_interface/identifiers.hpp"

namespace selfcal::ins {

struct DbcIdentifiers {
  std::uint32_t request = can_id::request;
  std::uint32_t response = can_id::response;
  std::uint32_t functional = can_id::functional;
  std::optional<std::uint32_t> status = can_id::status;  // the gimbal frame has the next; none: no such frames
  bool extended = false;
};
std::string dbc_text(const DbcIdentifiers& identifiers = {});

}  // namespace selfcal::ins
